import { type PerspectiveCamera, type Scene, Vector3, type WebGLRenderer } from "three";
import { Groom } from "../src/hair/groom";
import { rigidPose } from "../src/hair/pose";
import { HairScene, type HairSceneOptions } from "../src/scene/index";

/**
 * A .groom file in base64, so that it needs no download: a strand from the head joint to 1 cm below it, and as the body
 * a tetrahedron with edges of 1 cm along the axes. `hairnet-groom import` makes such a file of two .obj files, and
 * `hairnet-groom inspect` shows what is in one. The test fails when the page's module cannot read it.
 */
const kGroom =
  "MAEAABAAAABITkdaCAAMAAQACAAIAAAAFAIAAAQAAAANAQAAdZA/S8NgEIefi1HkxaGIYAfBQgJ16ODkH/pSx0oRKdLRwcGhLk46uPkN" +
  "onPHSHHI4CAoJe1Q2y0dnN5FwY/gkk3EISlqm/7guTvufhzH5SxoAPuH1SOoEdIBHnkg4J47mpxywjGblJilDVwKrJFnhRxLLGJTA54n" +
  "eAPyAlqg/oeGwOrT6267NSgr41RuL9+3gmFxG9gDGEUHFWV83W4Nyl4/1iUBV6Ag07eMoqirjB96/Vgr4/SUcUKvH4fjOnFd95Rxuh/A" +
  "mE/gC4C5f/tcAFvEsucXRCxr1g808M10WM8IWXKTdANeCgKS8qvlNHuQWCYkgJXRC4bFHeovVWV8DYIAdjprpvXF2fkVwA8AAAA=";
/** The scale of that groom in the picture: it is then smaller than a pixel. */
const kScale = 1e-4;
/** The hair is this far in front of the camera. */
const kAheadM = 2;

/**
 * Draws a hair and a body that are too small to be seen, while the first hairstyle is on its way: the machine then
 * makes the shaders, which takes seconds where software plays the GPU. Keep it until there is other hair, which uses
 * the same shaders.
 */
export class ShaderWarmUp {
  readonly #hair: HairScene;
  #groom: Groom | null = null;
  /** The shaders are made, or cannot be: `draw` does nothing any more. */
  #isOver = false;

  constructor(
    private readonly renderer: WebGLRenderer,
    private readonly scene: Scene,
    private readonly camera: PerspectiveCamera,
    options: HairSceneOptions,
  ) {
    this.#hair = new HairScene({ sample: () => [this.#member()] }, renderer, options);
    this.#hair.lightFollowsHair = false;
    this.#hair.scale.setScalar(kScale);
    void this.#load();
  }

  /** Call it before pictures. Draws the whole scene to the canvas, once. */
  draw(): void {
    if (this.#isOver) return;
    const ahead = this.camera.getWorldDirection(new Vector3());
    this.#hair.position.copy(this.camera.position).addScaledVector(ahead, kAheadM);
    this.#hair.update(this.camera);
    // Until the worker has made the geometry there is nothing to draw.
    this.#isOver = [...this.#hair.characters.values()].every((one) => one.isReady);
    if (!this.#isOver) return;
    this.scene.add(this.#hair);
    this.renderer.render(this.scene, this.camera);
    this.#hair.removeFromParent();
  }

  dispose(): void {
    this.#isOver = true;
    this.#hair.dispose();
  }

  async #load(): Promise<void> {
    try {
      this.#groom = await Groom.load(Uint8Array.from(atob(kGroom), (letter) => letter.charCodeAt(0)));
    } catch {
      // The module cannot start, or does not read the groom. There is no warm-up then, and the first real hairstyle
      // reports what is wrong.
      this.#isOver = true;
    }
  }

  #member() {
    return { member: 1, own: false, groomKey: "tiny", groom: this.#groom, pose: rigidPose(), lattice: null };
  }
}
