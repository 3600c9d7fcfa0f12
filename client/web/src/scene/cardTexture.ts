import {
  ClampToEdgeWrapping,
  LinearFilter,
  LinearMipmapLinearFilter,
  WebGLRenderTarget,
  type Texture,
  type WebGLRenderer,
} from "three";
import { kCardTextureHeight, kCardTextureWidth } from "../generated/constants";
import { drawAside, Pass } from "./pass";

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
  /** The texture on the GPU has its contents. */
  #isDrawn = false;

  get texture(): Texture {
    return this.#target.texture;
  }

  /** The contents are lost: the next `draw` draws it again. */
  forget(): void {
    this.#isDrawn = false;
  }

  /** Draws the texture unless it is drawn already. The conditions of `drawAside` (pass.ts) hold. */
  draw(renderer: WebGLRenderer): void {
    if (this.#isDrawn) return;
    this.#isDrawn = true;
    const pass = new Pass("screen.vert", "card_texture.frag", { exposure: { value: 1 }, encode_srgb: { value: 0 } });
    drawAside(renderer, () => {
      renderer.setRenderTarget(this.#target);
      // One triangle of three vertices covers the whole target.
      pass.draw(renderer, 3);
    });
    pass.dispose();
  }

  dispose(): void {
    this.#target.dispose();
  }
}
