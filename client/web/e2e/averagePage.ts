// One head before a plain background, drawn with and without `Picture`, for average.e2e.ts.
import { Color, PerspectiveCamera, Scene, WebGLRenderer, WebGLRenderTarget, type ColorSpace } from "three";
import { Groom } from "../src/hair/groom";
import { rigidPose } from "../src/hair/pose";
import { HairScene, Picture, type HairSource } from "../src/scene/index";

/** Rows of pixels, each red, green and blue, 0 to 255. */
export type Pixels = Float32Array;

/** The reference has kFine x kFine samples a pixel, each with coverage of its own. */
const kFine = 8;

export class AverageStage implements HairSource {
  readonly canvas = document.createElement("canvas");
  readonly renderer = new WebGLRenderer({ canvas: this.canvas, antialias: true, preserveDrawingBuffer: true });
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera(35, 1, 0.05, 50);
  readonly hair = new HairScene(this, this.renderer);
  readonly picture = new Picture(this.renderer);

  /** `groom`: the address of a file. */
  static async open(groom: string, sizePx: number, colour: number): Promise<AverageStage> {
    const bytes = new Uint8Array(await (await fetch(groom)).arrayBuffer());
    const stage = new AverageStage(await Groom.load(bytes), sizePx);
    for (;;) {
      stage.hair.update(stage.camera);
      const head = stage.hair.characters.get(1);
      head?.hairColour.setHex(colour);
      // All strands are drawn, as thin as they are for a near head: such a picture has the most grain.
      if (head) head.detail = { strandShare: 1, followHairCount: 1, toleranceM: 1e-3, quadratic: 1 };
      if (head?.isReady) return stage;
      await new Promise((done) => setTimeout(done, 20));
    }
  }

  constructor(
    readonly groom: Groom,
    readonly sizePx: number,
  ) {
    this.renderer.setSize(sizePx, sizePx, false);
    this.scene.background = new Color(0x8090a0);
    this.scene.add(this.hair);
    this.camera.position.set(0, 0.03, 0.6);
    this.camera.lookAt(0, 0, 0);
    // Only the middle half of the view is drawn, which is full of hair. Its grain is like that of the whole view, which
    // takes software four times as long.
    this.camera.setViewOffset(2 * sizePx, 2 * sizePx, sizePx / 2, sizePx / 2, sizePx, sizePx);
    document.body.append(this.canvas);
  }

  sample() {
    return [{ member: 1, own: false, groomKey: "a", groom: this.groom, pose: rigidPose(), lattice: null }];
  }

  /** Draws one picture without `Picture`; `seed` chooses its grain. */
  single(seed: number): Pixels {
    this.hair.update(this.camera);
    this.hair.ditherSeed = seed;
    this.renderer.render(this.scene, this.camera);
    this.hair.ditherSeed = 0;
    return this.#read();
  }

  /** Draws the next picture with `Picture`, which averages it with those before. */
  averaged(): Pixels {
    this.hair.update(this.camera);
    this.picture.render(this.scene, this.camera, this.hair);
    return this.#read();
  }

  /** Draws with kFine^2 samples a pixel, and averages them. */
  reference(seed: number): Pixels {
    const size = kFine * this.sizePx;
    const target = new WebGLRenderTarget(size, size, {
      internalFormat: "RGBA8",
      colorSpace: this.renderer.outputColorSpace as ColorSpace,
    });
    // three.js encodes colours for such a target as it does for the canvas.
    Object.assign(target, { isXRRenderTarget: true });
    this.hair.update(this.camera);
    this.hair.ditherSeed = seed;
    this.renderer.setRenderTarget(target);
    this.renderer.render(this.scene, this.camera);
    const fine = new Uint8Array(4 * size * size);
    this.renderer.readRenderTargetPixels(target, 0, 0, size, size, fine);
    this.hair.ditherSeed = 0;
    this.renderer.setRenderTarget(null);
    target.dispose();
    const sums = new Float32Array(3 * this.sizePx ** 2);
    for (let n = 0; n < size * size; ++n) {
      const at = 3 * (Math.floor((n % size) / kFine) + this.sizePx * Math.floor(n / size / kFine));
      for (let c = 0; c < 3; ++c) sums[at + c] += fine[4 * n + c] / kFine ** 2;
    }
    return sums;
  }

  #read(): Pixels {
    const { gl, size } = { gl: this.renderer.getContext(), size: this.sizePx };
    const bytes = new Uint8Array(4 * size * size);
    gl.readPixels(0, 0, size, size, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    return new Float32Array(bytes.length * 0.75).map((_, n) => bytes[4 * Math.floor(n / 3) + (n % 3)]);
  }

  dispose(): void {
    this.picture.dispose();
    this.hair.dispose();
    this.renderer.dispose();
    this.canvas.remove();
  }
}

/** The mean of squared differences. */
export function difference(a: Pixels, b: Pixels): number {
  return a.reduce((sum, value, n) => sum + (value - b[n]) ** 2, 0) / a.length;
}

Object.assign(window, { AverageStage, difference });
