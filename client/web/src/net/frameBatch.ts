import { HairnetError } from "../hair/hairnetError";
import { ErrorClass, LevelIndex } from "../hair/level";

// `frames` of a FrameBatch: one frame after the other without anything between (schema/PROTOCOL.md, Frames).

/** A frame as it travels, its content still coded. */
export interface CodedFrame {
  readonly member: number;
  readonly level: LevelIndex;
  readonly errorClass: ErrorClass;
  /** do not interpolate from the last frame */
  readonly discontinuous: boolean;
  /** no frame will come before the character wakes */
  readonly asleep: boolean;
  readonly velocities: boolean;
  /** the content has coefficients of the groom's basis instead of nodes */
  readonly coefficients: boolean;
  /** 0 to 3: of the earlier frames that it refers to, `stride` ticks apart */
  readonly order: number;
  readonly stride: number;
  /** ticks from one step of the character to the next */
  readonly stepStride: number;
  readonly content: Uint8Array;
}

const kMemberMax = 0xffffffff;

/** Splits them. Contents lie in `packed`. Throws `HairnetError`. */
export function decodeFrames(packed: Uint8Array): CodedFrame[] {
  const frames: CodedFrame[] = [];
  let at = 0;
  let member = 0;

  const takeByte = (): number => {
    if (at >= packed.length) throw new HairnetError("invalid", "frame batch: ends within a frame");
    return packed[at++];
  };
  const takeVarint = (): number => {
    let sum = 0;
    for (let factor = 1; factor < 2 ** 35; factor *= 128) {
      const byte = takeByte();
      sum += (byte & 0x7f) * factor;
      if (byte & 0x80) continue;
      if (sum <= kMemberMax) return sum;
      break;
    }
    throw new HairnetError("invalid", "frame batch: a number too large");
  };

  while (at < packed.length) {
    const step = takeVarint();
    const head = takeByte();
    const reference = takeByte();
    const byteCount = takeVarint();
    if (byteCount > packed.length - at) throw new HairnetError("invalid", "frame batch: ends within a frame");
    if (step === 0 || member + step > kMemberMax)
      throw new HairnetError("invalid", "frame batch: members do not ascend");
    member += step;
    const level: LevelIndex = head & 7;
    const errorClass: ErrorClass = head >> 6;
    const stride = (reference >> 2) & 3;
    const stepStride = (reference >> 4) & 3;
    if (level > LevelIndex.rigid) throw new HairnetError("invalid", `level ${level} does not exist`);
    if (errorClass > ErrorClass.oneMm) throw new HairnetError("invalid", "frame: no such error class");
    if (stride === 3 || stepStride === 3 || reference >> 7 !== 0)
      throw new HairnetError("invalid", "frame: no such stride");
    const coefficients = (reference & 64) !== 0;
    if (coefficients && ((head & 32) !== 0 || (reference & 3) !== 0))
      throw new HairnetError("invalid", "frame: coefficients refer to no other frame");
    frames.push({
      member,
      level,
      errorClass,
      discontinuous: (head & 8) !== 0,
      asleep: (head & 16) !== 0,
      velocities: (head & 32) !== 0,
      coefficients,
      order: reference & 3,
      stride: 1 << stride,
      stepStride: 1 << stepStride,
      content: packed.subarray(at, at + byteCount),
    });
    at += byteCount;
  }
  return frames;
}
