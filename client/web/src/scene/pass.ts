import {
  Camera,
  DoubleSide,
  GLSL3,
  InstancedBufferGeometry,
  Mesh,
  NearestFilter,
  NoBlending,
  Points,
  RawShaderMaterial,
  RGBAIntegerFormat,
  UnsignedIntType,
  WebGLRenderTarget,
  type IUniform,
  type WebGLRenderer,
} from "three";
import { shader } from "./shaders";

/** three.js wants a camera for each drawing. The shaders of passes use none. */
const nowhere = new Camera();

/** Draws numbers into a target by a pair of shaders, without a scene, a camera or attributes of vertices. */
export class Pass {
  readonly #geometry = new InstancedBufferGeometry();
  readonly #material: RawShaderMaterial;
  readonly #object: Mesh | Points;

  /**
   * `vertex`, `fragment`: names of shaders (`shader`). `points`: the pass draws points, and this is how they are
   * blended; null: it draws triangles without blending.
   */
  constructor(
    vertex: string,
    fragment: string,
    uniforms: Record<string, IUniform>,
    points: Pick<RawShaderMaterial, "blending" | "blendEquation" | "blendSrc" | "blendDst"> | null = null,
  ) {
    this.#material = new RawShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: shader(vertex),
      fragmentShader: shader(fragment),
      uniforms,
      side: DoubleSide,
      depthTest: false,
      depthWrite: false,
      ...(points ?? { blending: NoBlending }),
    });
    this.#object = points ? new Points(this.#geometry, this.#material) : new Mesh(this.#geometry, this.#material);
    this.#object.frustumCulled = false;
  }

  /** Draws into the current target. */
  draw(renderer: WebGLRenderer, vertices: number, instances = 1): void {
    this.#geometry.setDrawRange(0, vertices);
    this.#geometry.instanceCount = instances;
    renderer.render(this.#object, nowhere);
  }

  dispose(): void {
    this.#geometry.dispose();
    this.#material.dispose();
  }
}

/**
 * Calls `draw`, which sets targets and draws passes into them. Afterwards the renderer has its target and its settings
 * of before. Do not call it while the renderer draws something else.
 */
export function drawAside(renderer: WebGLRenderer, draw: () => void): void {
  const before = renderer.getRenderTarget();
  const { autoClear, xr } = renderer;
  const isXr = xr.enabled;
  renderer.autoClear = xr.enabled = false;
  draw();
  renderer.setRenderTarget(before);
  renderer.autoClear = autoClear;
  xr.enabled = isXr;
}

/** Reads floats back from a `bitsTarget`: this many texels from the beginning of a row on. For tests. */
export function readBits(
  renderer: WebGLRenderer,
  target: WebGLRenderTarget,
  row: number,
  texels: number,
): Float32Array {
  const rows = Math.ceil(texels / target.width);
  const bits = new Uint32Array(4 * target.width * rows);
  renderer.readRenderTargetPixels(target, 0, row, target.width, rows, bits);
  return new Float32Array(bits.buffer, 0, 4 * texels);
}

/** Makes a target whose texels are the bits of four floats, since a device may be unable to draw floats. */
export function bitsTarget(width: number): WebGLRenderTarget {
  return new WebGLRenderTarget(width, 1, {
    format: RGBAIntegerFormat,
    type: UnsignedIntType,
    internalFormat: "RGBA32UI",
    minFilter: NearestFilter,
    magFilter: NearestFilter,
    generateMipmaps: false,
    depthBuffer: false,
  });
}
