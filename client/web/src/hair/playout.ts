import type { HairBasis } from "./basis";
import type { Frame } from "./frame";
import { LevelIndex } from "./level";
import { addPoseStep, interpolatePose, poseStep, rigidPose, type Pose } from "./pose";
import { smoothstep } from "./smoothstep";

const kFramesMax = 256; // stored while no caller samples
const kArrivalsMax = 60; // two seconds at 30 Hz
const kIntervalDefaultNs = 33_333_333;
const kFreezeNs = 100_000_000;
const kEaseToRestNs = 500_000_000;
// The delay changes by at most this share of the elapsed time: motion becomes slower or faster, but too little to
// notice.
const kSlewMax = 0.1;
// Farther frames say nothing about the speed at a frame.
const kSmoothNsMax = 300_000_000;
// How long the last speed would go on if it did not become less.
const kGoOnNs = 33e6;
const kCorrectNsMin = 40_000_000;
const kCorrectNsMax = 100_000_000;
// Nobody sees a smaller correction.
const kCorrectMinM = 1e-9;

/**
 * The state to draw at one moment, valid until the next call of `sample`: the play-out writes each sample into the same
 * object and arrays.
 */
export interface PlayoutSample {
  readonly pose: Pose;
  /** that the server steps */
  readonly level: LevelIndex;
  /** m, of the basis; those that are missing are 0 */
  readonly coefficients: Float32Array;
  /** null: at rest */
  readonly basis: HairBasis | null;
  /** the sample time that is shown; never decreases */
  readonly timeNs: number;
}

type State = Omit<PlayoutSample, "timeNs">;

/** A state that is written again and again. */
class ShownState implements PlayoutSample {
  readonly pose = rigidPose();
  level = LevelIndex.rigid;
  basis: HairBasis | null = null;
  /** one for each mode of the basis */
  coefficients: Float32Array = kNone;
  timeNs = 0;

  /** Sets all coefficients to 0. */
  clear(basis: HairBasis | null): void {
    if (basis === this.basis) this.coefficients.fill(0);
    else this.coefficients = basis ? new Float32Array(basis.basis.unit.length) : kNone;
    this.basis = basis;
  }

  set({ pose, level, coefficients, basis }: State): void {
    this.pose.set(pose);
    this.level = level;
    this.clear(basis);
    this.add(coefficients, 1);
  }

  add(coefficients: Float32Array, weight: number): void {
    const sum = this.coefficients;
    const share = Math.fround(weight);
    const count = Math.min(sum.length, coefficients.length);
    for (let k = 0; k < count; ++k) sum[k] += share * coefficients[k];
  }
}

interface BufferedFrame {
  readonly timeNs: number;
  readonly discontinuous: boolean;
  /** shown until a newer frame comes */
  asleep: boolean;
  /** from one step of the character to the next; 0: not known */
  readonly stepNs: number;
  state: State;
}

/**
 * The jitter buffer of one character: plays its frames smoothly, with a small delay behind the newest. When no frame
 * comes it goes on, slower and slower, freezes, and after 100 ms, or after two steps of the character if that is
 * longer, eases to rest; a sleeping character stays frozen until it wakes. Time is an argument, always on the client's
 * clock, ns.
 *
 * Between two frames, coefficients move along a cubic whose slope at a frame is that of the parabola through it and its
 * neighbours. A frame that comes after its turn changes this curve: what is shown then is eased onto the new one.
 *
 * The lateness of a frame is its arrival time minus its sample time. The play-out delay is the smallest lateness of the
 * last frames, plus one frame interval (to have a frame to interpolate to), plus the larger of their jitter and half an
 * interval. The interval is one that nine of ten do not exceed, so that frames that are lost now and then leave no gap.
 */
export class Playout {
  /** by time; once sampled, at most three at or before the play time */
  readonly #frames: BufferedFrame[] = [];
  /** of the last frames, by arrival */
  readonly #arrivals: { readonly timeNs: number; readonly latenessNs: number }[] = [];
  /** between them, in order of size */
  readonly #intervals = new Float64Array(kArrivalsMax);
  /** the last result of sample() */
  readonly #shown = new ShownState();
  /** shares of frames i - 2 to i + 2 in the coefficients */
  readonly #weights = new Float64Array(5);
  // What a frame that came after its turn changed: what was shown then, less the new curve.
  readonly #offset = new ShownState();
  #isCorrecting = false;
  #correctBegunNs = 0;
  #correctNs = 0;
  #started = false;
  /** of the arrivals; null: must be computed again */
  #target: number | null = null;
  #renderTimeNs = 0;
  #delayNs = 0;
  #droppedCount = 0;

  get droppedCount(): number {
    return this.#droppedCount;
  }
  /** from sample time to play time */
  get delayNs(): number {
    return this.#delayNs;
  }

  /**
   * Takes a frame whose poses were sampled at `sampleTimeNs` and which arrived at `arrivalTimeNs`. Drops duplicates and
   * frames that are older than the one that is played; a frame that had no basis yet may come again with it. Keeps the
   * frame's arrays.
   */
  push(frame: Frame, sampleTimeNs: number, arrivalTimeNs: number): void {
    const frames = this.#frames;
    const { discontinuous, asleep, pose, level, coefficients, basis } = frame;
    const played = this.#started ? this.#indexAt(this.#shown.timeNs) : -1;
    let index = frames.length;
    while (index > 0 && frames[index - 1].timeNs >= sampleTimeNs) --index;
    const gapNs = index > 0 ? sampleTimeNs - frames[index - 1].timeNs : 0;
    if (index < frames.length && frames[index].timeNs === sampleTimeNs) {
      if (!frame.repeated) {
        ++this.#droppedCount;
        return;
      }
      frames[index].state = { ...frames[index].state, coefficients: withoutLastZeros(coefficients), basis };
    } else {
      this.#recordArrival(sampleTimeNs, arrivalTimeNs);
      if (frames.length > 0 && index <= played) {
        ++this.#droppedCount;
        return;
      }
      const state = { pose, level, coefficients: withoutLastZeros(coefficients), basis };
      frames.splice(index, 0, {
        timeNs: sampleTimeNs,
        discontinuous,
        asleep,
        stepNs: Math.round(1e9 * frame.stepS),
        state,
      });
    }
    if (this.#started && index <= played + 2) this.#correct(gapNs);
    if (frames.length > kFramesMax) {
      frames.shift();
      ++this.#droppedCount;
    }
  }

  /**
   * Freezes the shown state until the next frame arrives. For callers that know that no frame will come for a while, as
   * during a reconnect.
   */
  freeze(): void {
    const last = this.#frames[this.#frames.length - 1];
    if (!last) return;
    // The shown state may already be easing.
    if (this.#started && this.#shown.timeNs >= last.timeNs) {
      const { pose, level, coefficients, basis } = this.#shown;
      last.state = { pose: pose.slice(), level, coefficients: coefficients.slice(), basis };
      this.#isCorrecting = false;
    }
    last.asleep = true;
  }

  /**
   * Returns what to draw at `renderTimeNs`; a time before the last one counts as the last one. Null until the first
   * frame. The result is valid until the next call.
   */
  sample(renderTimeNs: number): PlayoutSample | null {
    const frames = this.#frames;
    if (frames.length === 0) return null;
    const shown = this.#shown;
    const from = this.#started ? this.#indexAt(shown.timeNs) : 0;
    this.#advance(renderTimeNs);
    const to = this.#indexAt(shown.timeNs);
    for (let i = from; i < to; ++i) if (!this.#isJoined(i)) this.#isCorrecting = false;
    while (frames.length > 3 && frames[3].timeNs <= shown.timeNs) frames.shift();
    this.#showCurve(shown.timeNs, shown);
    this.#applyCorrection();
    return shown;
  }

  #recordArrival(sampleTimeNs: number, arrivalTimeNs: number): void {
    this.#arrivals.push({ timeNs: sampleTimeNs, latenessNs: arrivalTimeNs - sampleTimeNs });
    if (this.#arrivals.length > kArrivalsMax) this.#arrivals.shift();
    this.#target = null;
  }

  #targetDelayNs(): number {
    const arrivals = this.#arrivals;
    let least = Infinity;
    let most = -Infinity;
    let count = 0;
    for (let i = 0; i < arrivals.length; ++i) {
      const { timeNs, latenessNs } = arrivals[i];
      least = Math.min(least, latenessNs);
      most = Math.max(most, latenessNs);
      if (i > 0 && timeNs > arrivals[i - 1].timeNs) this.#intervals[count++] = timeNs - arrivals[i - 1].timeNs;
    }
    const intervals = this.#intervals.subarray(0, count).sort();
    const mostOf = intervals[Math.floor((9 * (count - 1)) / 10)] ?? kIntervalDefaultNs;
    const interval = Math.max(mostOf, this.#frames[this.#frames.length - 1].stepNs);
    return least + interval + Math.max(Math.floor(interval / 2), most - least);
  }

  /** Advances the play time to `renderTimeNs`. */
  #advance(renderTimeNs: number): void {
    this.#target ??= this.#targetDelayNs();
    const target = this.#target;
    if (!this.#started) {
      this.#started = true;
      this.#renderTimeNs = renderTimeNs;
      this.#delayNs = target;
      this.#shown.timeNs = renderTimeNs - target;
      return;
    }
    const elapsed = Math.max(0, renderTimeNs - this.#renderTimeNs);
    this.#renderTimeNs += elapsed;
    const starved = this.#frames[this.#frames.length - 1].timeNs < this.#shown.timeNs;
    const slew = Math.floor(kSlewMax * elapsed);
    // There is no newer frame to show. Stop the play time here, so that late frames are in time again.
    if (starved && target > this.#delayNs) this.#delayNs = target;
    else this.#delayNs += Math.min(Math.max(target - this.#delayNs, -slew), slew);
    this.#shown.timeNs = Math.max(this.#shown.timeNs, this.#renderTimeNs - this.#delayNs);
  }

  /** The last frame that is not after a time, or the first. */
  #indexAt(timeNs: number): number {
    const frames = this.#frames;
    let i = 0;
    while (i + 1 < frames.length && frames[i + 1].timeNs <= timeNs) ++i;
    return i;
  }

  /** Whether frame i and the next may be mixed. */
  #isJoined(i: number): boolean {
    const to = this.#frames[i + 1];
    return !to.discontinuous && areJoined(this.#frames[i].state, to.state);
  }

  /**
   * Whether frame i and the next say how fast the character moved. Where they are far nearer than its steps, the estimate
   * of the server's clock has changed between them.
   */
  #isSmooth(i: number): boolean {
    const [from, to] = [this.#frames[i], this.#frames[i + 1]];
    const apartNs = this.#durationNs(i);
    if (!this.#isJoined(i) || from.asleep || apartNs > kSmoothNsMax) return false;
    return 2 * apartNs >= Math.min(from.stepNs, to.stepNs);
  }

  #durationNs(i: number): number {
    return this.#frames[i + 1].timeNs - this.#frames[i].timeNs;
  }

  /** Adds a share of the mean speed between frame j and the next. */
  #addDifference(i: number, j: number, share: number): void {
    const weight = share / this.#durationNs(j);
    this.#weights[j + 1 + 2 - i] += weight;
    this.#weights[j + 2 - i] -= weight;
  }

  /**
   * Adds a share of the speed at frame j: of the parabola through it and its neighbours, or, at an end, through it and
   * the two next to it.
   */
  #addSlope(i: number, j: number, share: number): void {
    const count = this.#frames.length;
    const hasBefore = j > 0 && this.#isSmooth(j - 1);
    const hasAfter = j + 1 < count && this.#isSmooth(j);
    if (hasBefore && hasAfter) {
      const h0 = this.#durationNs(j - 1);
      const h = this.#durationNs(j);
      this.#addDifference(i, j - 1, (share * h) / (h0 + h));
      this.#addDifference(i, j, (share * h0) / (h0 + h));
    } else if (hasBefore) {
      const hasTwo = j > 1 && this.#isSmooth(j - 2);
      const bend = hasTwo ? this.#durationNs(j - 1) / (this.#durationNs(j - 2) + this.#durationNs(j - 1)) : 0;
      this.#addDifference(i, j - 1, share * (1 + bend));
      if (hasTwo) this.#addDifference(i, j - 2, -share * bend);
    } else if (hasAfter) {
      const hasTwo = j + 2 < count && this.#isSmooth(j + 1);
      const bend = hasTwo ? this.#durationNs(j) / (this.#durationNs(j) + this.#durationNs(j + 1)) : 0;
      this.#addDifference(i, j, share * (1 + bend));
      if (hasTwo) this.#addDifference(i, j + 1, -share * bend);
    }
  }

  /** Adds the coefficients of frames i - 2 to i + 2 by their weights. */
  #addFrames(i: number, out: ShownState): void {
    for (let w = 0; w < this.#weights.length; ++w) {
      const weight = this.#weights[w];
      if (weight !== 0) out.add(this.#frames[i + w - 2].state.coefficients, weight);
    }
  }

  #showCurve(timeNs: number, out: ShownState): void {
    const i = this.#indexAt(timeNs);
    const { timeNs: fromNs, state } = this.#frames[i];
    if (i + 1 === this.#frames.length) this.#showAfterLast(timeNs, out);
    else if (timeNs <= fromNs || !this.#isJoined(i)) out.set(state);
    else this.#showBetween(i, timeNs, out);
  }

  /**
   * The cubic with the values c_0, c_1 and the slopes m_0, m_1 at the ends of an interval of duration h:
   *
   *   c(s) = c_0 + s^2 (3 - 2 s) (c_1 - c_0) + s (1 - s)^2 h m_0 - s^2 (1 - s) h m_1.
   */
  #showBetween(i: number, timeNs: number, out: ShownState): void {
    const from = this.#frames[i];
    const to = this.#frames[i + 1];
    const h = this.#durationNs(i);
    const s = (timeNs - from.timeNs) / h;
    const isSmooth = this.#isSmooth(i);
    const ahead = isSmooth ? s * s * (3 - 2 * s) : s;
    const weights = this.#weights.fill(0);
    weights[2] = 1 - ahead;
    weights[3] = ahead;
    if (isSmooth) {
      this.#addSlope(i, i, s * (1 - s) * (1 - s) * h);
      this.#addSlope(i, i + 1, -s * s * (1 - s) * h);
    }
    interpolatePose(from.state.pose, to.state.pose, s, out.pose);
    out.level = to.state.level;
    out.clear(to.state.basis ?? from.state.basis);
    this.#addFrames(i, out);
  }

  #showAfterLast(timeNs: number, out: ShownState): void {
    const i = this.#frames.length - 1;
    const { state, asleep, stepNs, timeNs: lastNs } = this.#frames[i];
    const afterNs = Math.max(0, timeNs - lastNs);
    const weights = this.#weights.fill(0);
    weights[2] = 1;
    out.pose.set(state.pose);
    if (!asleep && i > 0 && this.#isSmooth(i - 1)) {
      const movedNs = kGoOnNs * (1 - Math.exp(-afterNs / kGoOnNs));
      this.#addSlope(i, i, movedNs);
      interpolatePose(this.#frames[i - 1].state.pose, state.pose, 1 + movedNs / this.#durationNs(i - 1), out.pose);
    }
    const waited = afterNs - Math.max(kFreezeNs, 2 * stepNs);
    const left = asleep ? 1 : 1 - smoothstep(0, kEaseToRestNs, waited);
    for (let w = 0; w < weights.length; ++w) weights[w] *= left;
    out.level = state.level;
    out.clear(state.basis);
    this.#addFrames(i, out);
  }

  /** The curve has changed: shows the same as before, and eases onto it. */
  #correct(gapNs: number): void {
    const shown = this.#shown;
    const offset = this.#offset;
    this.#showCurve(shown.timeNs, offset);
    this.#isCorrecting = areJoined(shown, offset);
    if (!this.#isCorrecting) return;
    this.#correctBegunNs = shown.timeNs;
    this.#correctNs = Math.min(Math.max(gapNs, kCorrectNsMin), kCorrectNsMax);
    const isPosed = poseStep(offset.pose, shown.pose, offset.pose);
    const isOther = offset.basis !== shown.basis;
    for (let k = 0; k < offset.coefficients.length; ++k) offset.coefficients[k] *= -1;
    if (!offset.basis) offset.clear(shown.basis);
    offset.add(shown.coefficients, 1);
    this.#isCorrecting = isPosed || isOther || offset.coefficients.some((c) => Math.abs(c) > kCorrectMinM);
  }

  #applyCorrection(): void {
    if (!this.#isCorrecting) return;
    const shown = this.#shown;
    const { pose, coefficients, basis } = this.#offset;
    const left = 1 - smoothstep(0, this.#correctNs, shown.timeNs - this.#correctBegunNs);
    if (left <= 0 || !areJoined(shown, this.#offset)) {
      this.#isCorrecting = false;
      return;
    }
    addPoseStep(shown.pose, pose, left);
    if (!shown.basis) shown.clear(basis);
    shown.add(coefficients, left);
  }
}

const kNone = new Float32Array(0);

/** Most frames have only the first coefficients. Each picture adds up several frames, so zeros at the end are left out. */
function withoutLastZeros(coefficients: Float32Array): Float32Array {
  let count = coefficients.length;
  while (count > 0 && coefficients[count - 1] === 0) --count;
  return coefficients.subarray(0, count);
}

function areJoined(from: Pick<State, "basis">, to: Pick<State, "basis">): boolean {
  return from.basis === to.basis || !from.basis || !to.basis;
}
