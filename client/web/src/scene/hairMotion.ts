import { ClampToEdgeWrapping, Data3DTexture, HalfFloatType, LinearFilter, Matrix4, RGBAFormat } from "three";
import { kMovingMax, kSwingNodes } from "../generated/constants";
import type { Records } from "./records";

/** The size of a `hairnet_motion` of client/hairnet.h: 32 doubles, a float, and padding. */
const kMotionBytes = 264;

/** The motion of one character's hair since the last picture. */
export interface Motion {
  /** Transforms head space to the scene, in this picture and in the one before. */
  readonly headToScene: Matrix4;
  readonly headToSceneBefore: Matrix4;
  /** The radius of the ball about the head that contains the hair, head space. */
  readonly ballRadiusM: number;
}

/** Where hair was in the last picture, for every place where it is now. */
export class HairMotion {
  /**
   * The displacement of hair in the box about each ball: where hair was minus where it is, head space, m. Each motion
   * has a cube of kSwingNodes^3 texels, and the cubes of the motions follow each other along z.
   */
  readonly swing: Data3DTexture;
  readonly #values = new Uint16Array(4 * kSwingNodes ** 3 * kMovingMax);

  constructor(private readonly records: Records) {
    this.swing = new Data3DTexture(this.#values, kSwingNodes, kSwingNodes, kSwingNodes * kMovingMax);
    this.swing.format = RGBAFormat;
    this.swing.type = HalfFloatType;
    this.swing.minFilter = this.swing.magFilter = LinearFilter;
    this.swing.wrapS = this.swing.wrapT = this.swing.wrapR = ClampToEdgeWrapping;
  }

  /** Returns the motions since the last call, for the records of the last picture, and writes `swing`. */
  motions(): Motion[] {
    const written = this.records.motions();
    if (!written) return [];
    const { module, at } = written;
    const words = module.wordMemory();
    // `written.at` is the address of a hairnet_motions: the address of the motions, their count, and the address of
    // swing.
    const [place, count, swing] = words.subarray(at / 4, at / 4 + 3);
    const motions = Array.from({ length: count }, (_, n) => {
      const one = place + kMotionBytes * n;
      const doubles = module.doubleMemory().subarray(one / 8, one / 8 + 32);
      return {
        headToScene: new Matrix4().fromArray(doubles),
        headToSceneBefore: new Matrix4().fromArray(doubles, 16),
        ballRadiusM: module.floatMemory()[(one + 256) / 4],
      };
    });
    if (count > 0) {
      this.#values.set(new Uint16Array(words.buffer, swing, count * (this.#values.length / kMovingMax)));
      this.swing.needsUpdate = true;
    }
    return motions;
  }

  dispose(): void {
    this.swing.dispose();
  }
}
