import { HairnetError } from "../hair/hairnetError";
import { LevelIndex } from "../hair/level";

// `frames` of a FrameBatch: one frame after the other without anything between (schema/PROTOCOL.md, Frames).

/** A frame as it travels, its content still coded. */
export interface CodedFrame {
  readonly member: number;
  /** that the server steps; rigid: the hair is at rest */
  readonly level: LevelIndex;
  /** do not interpolate from the last frame */
  readonly discontinuous: boolean;
  /** no frame will come before the character wakes */
  readonly asleep: boolean;
  /** only a pose: the client evaluates the learnt hair (EvaluateLearnt) */
  readonly evaluated: boolean;
  /** ticks from one step of the character to the next */
  readonly stepStride: number;
  readonly content: Uint8Array;
}

const kMemberMax = 0xffffffff;

/**
 * Splits them. Contents lie in `packed`. With `generations` each frame has its own before it, as in a frame datagram: they
 * are put there. Throws `HairnetError`.
 */
export function decodeFrames(packed: Uint8Array, generations?: number[]): CodedFrame[] {
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
    generations?.push(takeByte());
    const step = takeVarint();
    const head = takeByte();
    const byteCount = takeVarint();
    if (byteCount > packed.length - at) throw new HairnetError("invalid", "frame batch: ends within a frame");
    if (step === 0 || member + step > kMemberMax)
      throw new HairnetError("invalid", "frame batch: members do not ascend");
    member += step;
    const level: LevelIndex = head & 7;
    const logStride = (head >> 5) & 3;
    const evaluated = (head & 128) !== 0;
    if (level > LevelIndex.rigid) throw new HairnetError("invalid", `level ${level} does not exist`);
    if (logStride > 2) throw new HairnetError("invalid", "frame: no such stride");
    if (evaluated && level !== LevelIndex.learnt)
      throw new HairnetError("invalid", "frame: evaluated on another level than learnt");
    frames.push({
      member,
      level,
      discontinuous: (head & 8) !== 0,
      asleep: (head & 16) !== 0,
      evaluated,
      stepStride: 1 << logStride,
      content: packed.subarray(at, at + byteCount),
    });
    at += byteCount;
  }
  return frames;
}
