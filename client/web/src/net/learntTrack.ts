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
   * The coefficients (m) of the frame become those to show. `before`: those that were shown with the frame before; null:
   * none were. `hair`: null when the groom's is not here; a frame without coefficients needs it.
   */
  show(hair: LearntHair | null, frame: LearntFrame, before: Float32Array | null, coefficients: Float32Array): void {
    const isContinued = frame.from !== null && frame.ticks <= kLearntGapMaxTicks && !frame.discontinuous;
    const isNew = this.#step(hair, frame, isContinued);
    const share = kResidualKept ** Math.min(frame.ticks, 1000);
    this.#surprise = faded(this.#surprise, share);
    this.#residual = this.#hair ? faded(this.#residual, share) : kNone;
    if (frame.evaluated) this.#showEvaluated(isNew, frame, before, coefficients);
    else this.#showCoded(isNew, isContinued, coefficients);
    this.#wasEvaluated = frame.evaluated;
  }

  #showEvaluated(isNew: boolean, frame: LearntFrame, before: Float32Array | null, coefficients: Float32Array): void {
    this.#surprise = kNone;
    const evaluated = this.#evaluated;
    if (isNew) {
      // A network that begins here goes on from what was shown.
      const goesOn = !frame.discontinuous && before?.length === coefficients.length;
      this.#residual = goesOn ? before.map((c, k) => c - at(evaluated, k)) : kNone;
    }
    const residual = this.#residual;
    for (let k = 0; k < coefficients.length; ++k) coefficients[k] = at(evaluated, k) + at(residual, k);
  }

  #showCoded(isNew: boolean, isContinued: boolean, coefficients: Float32Array): void {
    const evaluated = this.#evaluated;
    const residual = this.#residual;
    if (!isContinued) this.#surprise = kNone;
    if (this.#wasEvaluated && isContinued && !isNew)
      this.#surprise = coefficients.map((c, k) => at(evaluated, k) + at(residual, k) - c);
    const surprise = this.#surprise;
    if (surprise.length > 0) for (let k = 0; k < coefficients.length; ++k) coefficients[k] += at(surprise, k);
    this.#residual = this.#hair ? coefficients.map((c, k) => c - at(evaluated, k)) : kNone;
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

/** In place; empty when nothing of it is left. */
function faded(numbers: Float32Array, share: number): Float32Array {
  let most = 0;
  for (let k = 0; k < numbers.length; ++k) {
    numbers[k] *= share;
    most = Math.max(most, Math.abs(numbers[k]));
  }
  return most < kNothingM ? kNone : numbers;
}
