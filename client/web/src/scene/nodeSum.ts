import type { WebGLRenderer } from "three";

/** Who sums up the modes of lattices. */
export type NodeSum = "gpu" | "processor";

const kSoftware = /swiftshader|llvmpipe|softpipe|software|microsoft basic render/i;

/** `renderer`: as WebGL names it. Software that plays a GPU is slower at this sum than the page's thread. */
export function nodeSumFor(renderer: string): NodeSum {
  return kSoftware.test(renderer) ? "processor" : "gpu";
}

/** The name of what draws; browsers that hide it give another one, or none. */
export function rendererName(renderer: WebGLRenderer): string {
  const gl = renderer.getContext();
  const info = gl.getExtension("WEBGL_debug_renderer_info");
  return String(gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
}
