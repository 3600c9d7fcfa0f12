import { kLearntGapMaxTicks, kLearntSettledTicks } from "../generated/constants";
import { LearntState, stepLearntMotion, type LearntHair, type LearntMotion } from "../hair/learntHair";
import type { Pose } from "../hair/pose";

// A tick: it is halved every 0.14 s.
const kResidualKept = 0.85;
// Nobody sees a smaller step of the hair.
const kNothingM = 1e-5;

/** What the hair of a member depends on beside the coefficients of its frame. */
export interface LearntFrame {
  /** of the frame before; null: there is none that the hair could continue */
  readonly from: Pose | null;
  readonly to: Pose;
  /** between the two */
  readonly ticks: number;
  /** on the learnt level */
  readonly isLearnt: boolean;
  /** without coefficients */
  readonly evaluated: boolean;
  readonly discontinuous: boolean;
}

/**
 * The hair of one member on the learnt level, from its poses. The network runs from frame to frame. What is shown is its
 * hair plus a residual that frames with coefficients set, and that decays while there are none; so a frame without
 * coefficients continues one with them. In turn, a frame with coefficients after one without is shown with what it
 * surprises by, which decays.
 */
export class LearntTrack {
  /** null: the track is empty */
  #hair: LearntHair | null = null;
  /** null: the network has seen no pose */
  #state: LearntState | null = null;
  /** by the network, at the last frame */
  #evaluated: Float32Array = kNone;
  /** shown less evaluated; empty: zero */
  #residual: Float32Array = kNone;
  /** shown less coded; empty: zero */
  #surprise: Float32Array = kNone;
  /** the last frame had no coefficients */
  #wasEvaluated = false;
  /** ticks since the network began */
  #followed = 0;

  /** Whether frames of other levels are shown as they are. */
  get isIdle(): boolean {
    return this.#hair === null && this.#surprise.length === 0;
  }

  /**
   * Whether the network has begun so late that a frame without coefficients came too early. The server knows of no gap.
   */
  get isUnsettled(): boolean {
    return this.#state !== null && this.#followed < kLearntSettledTicks - kLearntGapMaxTicks;
  }

  /**
   * The coefficients (m) to show, given those of the frame. `before`: those that were shown with the frame before;
   * null: none were. `hair`: null when the groom's is not here; a frame without coefficients needs it.
   */
  show(hair: LearntHair | null, frame: LearntFrame, before: Float32Array | null, coded: Float32Array): Float32Array {
    const isContinued = frame.from !== null && frame.ticks <= kLearntGapMaxTicks && !frame.discontinuous;
    const isNew = this.#step(hair, frame, isContinued);
    const count = coded.length;
    const share = kResidualKept ** Math.min(frame.ticks, 1000);
    this.#surprise = faded(this.#surprise, share);
    const residual = this.#hair ? sized(faded(this.#residual, share), count) : kNone;
    const evaluated = this.#evaluated;
    const shown = coded.slice();
    if (frame.evaluated) {
      this.#surprise = kNone;
      for (let k = 0; k < count; ++k) {
        // A network that begins here goes on from what was shown.
        if (isNew) residual[k] = !frame.discontinuous && before?.length === count ? before[k] - at(evaluated, k) : 0;
        shown[k] = at(evaluated, k) + residual[k];
      }
    } else {
      if (!isContinued) this.#surprise = kNone;
      if (this.#wasEvaluated && isContinued && !isNew)
        this.#surprise = coded.map((c, k) => at(evaluated, k) + at(residual, k) - c);
      for (let k = 0; k < count; ++k) shown[k] += at(this.#surprise, k);
      for (let k = 0; k < residual.length; ++k) residual[k] = shown[k] - at(evaluated, k);
    }
    this.#residual = residual;
    this.#wasEvaluated = frame.evaluated;
    return shown;
  }

  /** Steps the network to the frame's pose. Returns whether it begins there. */
  #step(hair: LearntHair | null, frame: LearntFrame, isContinued: boolean): boolean {
    const isGap = frame.from === null || frame.ticks > kLearntGapMaxTicks;
    // After the level ends, one more step says how the hair would have gone on.
    const isNeeded = frame.isLearnt || (this.#wasEvaluated && isContinued);
    if (!hair || !isNeeded) {
      this.#hair = this.#state = null;
      this.#wasEvaluated = false;
      this.#residual = kNone;
      return false;
    }
    if (isGap || hair !== this.#hair) this.#state = null;
    this.#hair = hair;
    this.#followed = this.#state ? this.#followed + frame.ticks : 0;
    if (this.#state && frame.discontinuous) {
      this.#state.poses.forget(); // the World does not step it either
      return false;
    }
    const begins = this.#state === null;
    if (begins) this.#evaluated = new Float32Array(hair.modeCount);
    this.#state ??= new LearntState(hair);
    const motion: LearntMotion = isContinued
      ? { from: frame.from!, to: frame.to, ticks: frame.ticks, begins }
      : { from: frame.to, to: frame.to, ticks: 0, begins };
    stepLearntMotion(hair, this.#state, motion, this.#evaluated);
    return begins;
  }
}

const kNone = new Float32Array(0);

function at(numbers: Float32Array, k: number): number {
  return k < numbers.length ? numbers[k] : 0;
}

/** Empty when nothing of it is left. */
function faded(numbers: Float32Array, share: number): Float32Array {
  const less = numbers.map((x) => share * x);
  return less.every((x) => Math.abs(x) < kNothingM) ? kNone : less;
}

function sized(numbers: Float32Array, count: number): Float32Array {
  if (numbers.length === count) return numbers;
  const out = new Float32Array(count);
  out.set(numbers.subarray(0, count));
  return out;
}
