import { ClampToEdgeWrapping, Data3DTexture, HalfFloatType, LinearFilter, Matrix4, RGBAFormat } from "three";
import { kMovingMax, kSwingNodes } from "../generated/constants";
import type { Records } from "./records";

/** `hairnet_motion` of client/hairnet.h. */
const kMotionBytes = 264;

/** The motion of one character's hair since the last picture. */
export interface Motion {
  /** head space -> scene */
  readonly headToScene: Matrix4;
  readonly headToSceneBefore: Matrix4;
  readonly ballRadiusM: number;
}

/** Where hair was in the last picture, for every place where it is now. */
export class HairMotion {
  /** Slices of kSwingNodes^3 texels, one for each motion: where hair was, minus where it is, head space, m. */
  readonly swing: Data3DTexture;
  readonly #values = new Uint16Array(4 * kSwingNodes ** 3 * kMovingMax);

  constructor(private readonly records: Records) {
    this.swing = new Data3DTexture(this.#values, kSwingNodes, kSwingNodes, kSwingNodes * kMovingMax);
    this.swing.format = RGBAFormat;
    this.swing.type = HalfFloatType;
    this.swing.minFilter = this.swing.magFilter = LinearFilter;
    this.swing.wrapS = this.swing.wrapT = this.swing.wrapR = ClampToEdgeWrapping;
  }

  /** Of the last `update`: returns the motions since the last call, and writes `swing`. */
  motions(): Motion[] {
    const written = this.records.motions();
    if (!written) return [];
    const { module, at } = written;
    const words = module.wordMemory();
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
