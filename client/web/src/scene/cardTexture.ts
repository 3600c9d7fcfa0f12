import {
  BufferGeometry,
  Camera,
  ClampToEdgeWrapping,
  GLSL3,
  LinearFilter,
  LinearMipmapLinearFilter,
  Mesh,
  NoBlending,
  RawShaderMaterial,
  WebGLRenderTarget,
  type Texture,
  type WebGLRenderer,
} from "three";
import { kCardTextureHeight, kCardTextureWidth } from "../generated/constants";
import { shader } from "./shaders";

/** The texture of cards, drawn by the GPU for the first cards, and again after its context was lost. */
export class CardTexture {
  readonly #target = new WebGLRenderTarget(kCardTextureWidth, kCardTextureHeight, {
    depthBuffer: false,
    generateMipmaps: true,
    minFilter: LinearMipmapLinearFilter,
    magFilter: LinearFilter,
    wrapS: ClampToEdgeWrapping,
    wrapT: ClampToEdgeWrapping,
  });
  #isDrawn = false;

  get texture(): Texture {
    return this.#target.texture;
  }

  /** The contents are lost: the next `draw` draws it again. */
  forget(): void {
    this.#isDrawn = false;
  }

  /** Draws it if necessary; do not call it while the renderer draws something else. */
  draw(renderer: WebGLRenderer): void {
    if (this.#isDrawn) return;
    this.#isDrawn = true;
    const geometry = new BufferGeometry();
    geometry.setDrawRange(0, 3);
    const material = new RawShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: shader("screen.vert"),
      fragmentShader: shader("card_texture.frag"),
      uniforms: { exposure: { value: 1 }, encode_srgb: { value: 0 } },
      depthTest: false,
      depthWrite: false,
      blending: NoBlending,
    });
    const triangle = new Mesh(geometry, material);
    triangle.frustumCulled = false;
    const before = renderer.getRenderTarget();
    const xr = renderer.xr.enabled;
    renderer.xr.enabled = false;
    renderer.setRenderTarget(this.#target);
    renderer.render(triangle, new Camera());
    renderer.setRenderTarget(before);
    renderer.xr.enabled = xr;
    geometry.dispose();
    material.dispose();
  }

  dispose(): void {
    this.#target.dispose();
  }
}
