import type { WebGLRenderer } from "three";
import type { Instance } from "../module/instance";

/**
 * Who sums up the modes of lattices: `hairnet_node_sum` of client/hairnet.h. Modes are the shapes in which the hair of
 * a groom moves (core/modes). A lattice from a server is a number for each, and the displacements of its nodes are the
 * sum of the modes, each times its number: many numbers for every moving head and picture.
 */
export enum NodeSum {
  gpu = 0,
  processor = 1,
}

/**
 * Who should sum up the modes for this renderer, as WebGL names it (`rendererName`). Software that plays a GPU is
 * slower at this sum than the page's thread.
 */
export function nodeSumFor(module: Instance, renderer: string): NodeSum {
  return module.call("hairnet_node_sum_for", module.name(renderer));
}

/** The name of the GPU, or of the software in its place. Browsers that hide it give another name, or none. */
export function rendererName(renderer: WebGLRenderer): string {
  const gl = renderer.getContext();
  const info = gl.getExtension("WEBGL_debug_renderer_info");
  return String(gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
}
