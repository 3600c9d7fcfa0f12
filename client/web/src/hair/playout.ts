import type { HairBasis } from "./basis";
import type { Frame } from "./frame";
import { LevelIndex } from "./level";
import { interpolatePose, movePose, rigidPose, type Pose } from "./pose";
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

/** The state to draw at one moment. The play-out owns its arrays; they are valid until its next call. */
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

interface State {
  readonly pose: Pose;
  readonly level: LevelIndex;
  readonly coefficients: Float32Array;
  /** null: at rest */
  readonly basis: HairBasis | null;
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

/** What a frame that came after its turn changed: the state that was shown then, and that of the new curve. */
interface Correction {
  readonly shown: State;
  readonly curve: State;
  readonly begunNs: number;
  readonly durationNs: number;
}

/** Shares of frames i - 2 to i + 2 in the coefficients. */
type Weights = [number, number, number, number, number];

/**
 * The jitter buffer of one character: plays its frames smoothly, with a small delay behind the newest. When no frame
 * comes it goes on, slower and slower, freezes, and after 100 ms, or after two steps of the character if that is longer,
 * eases to rest; a sleeping character stays frozen until it wakes. Time is an argument, always on the client's clock, ns.
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
  /** the last result of sample(), */
  #shown: State = { pose: rigidPose(), level: LevelIndex.rigid, coefficients: new Float32Array(0), basis: null };
  /** and its time */
  #timeNs = 0;
  #correction: Correction | null = null;
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
    const played = this.#started ? this.#indexAt(this.#timeNs) : -1;
    const index = frames.filter((each) => each.timeNs < sampleTimeNs).length;
    const gapNs = index > 0 ? sampleTimeNs - frames[index - 1].timeNs : 0;
    if (index < frames.length && frames[index].timeNs === sampleTimeNs) {
      if (!frame.repeated) {
        ++this.#droppedCount;
        return;
      }
      frames[index].state = { ...frames[index].state, coefficients, basis };
    } else {
      this.#recordArrival(sampleTimeNs, arrivalTimeNs);
      if (frames.length > 0 && index <= played) {
        ++this.#droppedCount;
        return;
      }
      const state = { pose, level, coefficients, basis };
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
    if (this.#started && this.#timeNs >= last.timeNs) {
      last.state = this.#shown;
      this.#correction = null;
    }
    last.asleep = true;
  }

  /**
   * Returns what to draw at `renderTimeNs`; a time before the last one counts as the last one. Null until the first
   * frame.
   */
  sample(renderTimeNs: number): PlayoutSample | null {
    const frames = this.#frames;
    if (frames.length === 0) return null;
    const from = this.#started ? this.#indexAt(this.#timeNs) : 0;
    this.#advance(renderTimeNs);
    const to = this.#indexAt(this.#timeNs);
    for (let i = from; i < to; ++i) if (!this.#isJoined(i)) this.#correction = null;
    while (frames.length > 3 && frames[3].timeNs <= this.#timeNs) frames.shift();
    this.#shown = this.#corrected(this.#curveAt(this.#timeNs));
    return { ...this.#shown, timeNs: this.#timeNs };
  }

  #recordArrival(sampleTimeNs: number, arrivalTimeNs: number): void {
    this.#arrivals.push({ timeNs: sampleTimeNs, latenessNs: arrivalTimeNs - sampleTimeNs });
    if (this.#arrivals.length > kArrivalsMax) this.#arrivals.shift();
    this.#target = null;
  }

  #targetDelayNs(): number {
    const arrivals = this.#arrivals;
    const lateness = arrivals.map((each) => each.latenessNs);
    const least = Math.min(...lateness);
    const most = Math.max(...lateness);
    const intervals = arrivals
      .map(({ timeNs }, i) => (i > 0 ? timeNs - arrivals[i - 1].timeNs : 0))
      .filter((ns) => ns > 0)
      .sort((a, b) => a - b);
    const mostOf = intervals[Math.floor((9 * (intervals.length - 1)) / 10)] ?? kIntervalDefaultNs;
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
      this.#timeNs = renderTimeNs - target;
      return;
    }
    const elapsed = Math.max(0, renderTimeNs - this.#renderTimeNs);
    this.#renderTimeNs += elapsed;
    const starved = this.#frames[this.#frames.length - 1].timeNs < this.#timeNs;
    const slew = Math.floor(kSlewMax * elapsed);
    // There is no newer frame to show. Stop the play time here, so that late frames are in time again.
    if (starved && target > this.#delayNs) this.#delayNs = target;
    else this.#delayNs += Math.min(Math.max(target - this.#delayNs, -slew), slew);
    this.#timeNs = Math.max(this.#timeNs, this.#renderTimeNs - this.#delayNs);
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
    const [from, to] = [this.#frames[i], this.#frames[i + 1]];
    return !to.discontinuous && areJoined(from.state, to.state);
  }

  /** Whether frame i and the next say how fast the character moved. */
  #isSmooth(i: number): boolean {
    return this.#isJoined(i) && !this.#frames[i].asleep && this.#durationNs(i) <= kSmoothNsMax;
  }

  #durationNs(i: number): number {
    return this.#frames[i + 1].timeNs - this.#frames[i].timeNs;
  }

  /** Adds a share of the mean speed between frame j and the next. */
  #addDifference(i: number, j: number, share: number, weights: Weights): void {
    weights[j + 1 + 2 - i] += share / this.#durationNs(j);
    weights[j + 2 - i] -= share / this.#durationNs(j);
  }

  /**
   * Adds a share of the speed at frame j: of the parabola through it and its neighbours, or, at an end, through it and
   * the two next to it.
   */
  #addSlope(i: number, j: number, share: number, weights: Weights): void {
    const count = this.#frames.length;
    const hasBefore = j > 0 && this.#isSmooth(j - 1);
    const hasAfter = j + 1 < count && this.#isSmooth(j);
    if (hasBefore && hasAfter) {
      const [h0, h] = [this.#durationNs(j - 1), this.#durationNs(j)];
      this.#addDifference(i, j - 1, (share * h) / (h0 + h), weights);
      this.#addDifference(i, j, (share * h0) / (h0 + h), weights);
    } else if (hasBefore) {
      const hasTwo = j > 1 && this.#isSmooth(j - 2);
      const bend = hasTwo ? this.#durationNs(j - 1) / (this.#durationNs(j - 2) + this.#durationNs(j - 1)) : 0;
      this.#addDifference(i, j - 1, share * (1 + bend), weights);
      if (hasTwo) this.#addDifference(i, j - 2, -share * bend, weights);
    } else if (hasAfter) {
      const hasTwo = j + 2 < count && this.#isSmooth(j + 1);
      const bend = hasTwo ? this.#durationNs(j) / (this.#durationNs(j) + this.#durationNs(j + 1)) : 0;
      this.#addDifference(i, j, share * (1 + bend), weights);
      if (hasTwo) this.#addDifference(i, j + 1, -share * bend, weights);
    }
  }

  #blended(i: number, weights: Weights): Float32Array {
    const of = (w: number) => this.#frames[i + w - 2].state.coefficients;
    let count = 0;
    weights.forEach((weight, w) => {
      if (weight !== 0) count = Math.max(count, of(w).length);
    });
    const blended = new Float32Array(count);
    weights.forEach((weight, w) => {
      if (weight === 0) return;
      const c = of(w);
      const share = Math.fround(weight);
      for (let k = 0; k < c.length; ++k) blended[k] += share * c[k];
    });
    return blended;
  }

  #curveAt(timeNs: number): State {
    const i = this.#indexAt(timeNs);
    if (i + 1 === this.#frames.length) return this.#afterLast(timeNs);
    const from = this.#frames[i];
    return timeNs <= from.timeNs || !this.#isJoined(i) ? from.state : this.#between(i, timeNs);
  }

  /**
   * The cubic with the values c_0, c_1 and the slopes m_0, m_1 at the ends of an interval of duration h:
   *
   *   c(s) = c_0 + s^2 (3 - 2 s) (c_1 - c_0) + s (1 - s)^2 h m_0 - s^2 (1 - s) h m_1.
   */
  #between(i: number, timeNs: number): State {
    const [from, to] = [this.#frames[i], this.#frames[i + 1]];
    const h = this.#durationNs(i);
    const s = (timeNs - from.timeNs) / h;
    const isSmooth = this.#isSmooth(i);
    const ahead = isSmooth ? s * s * (3 - 2 * s) : s;
    const weights: Weights = [0, 0, 1 - ahead, ahead, 0];
    if (isSmooth) {
      this.#addSlope(i, i, s * (1 - s) * (1 - s) * h, weights);
      this.#addSlope(i, i + 1, -s * s * (1 - s) * h, weights);
    }
    return {
      pose: interpolatePose(from.state.pose, to.state.pose, s, rigidPose()),
      level: to.state.level,
      coefficients: this.#blended(i, weights),
      basis: to.state.basis ?? from.state.basis,
    };
  }

  #afterLast(timeNs: number): State {
    const i = this.#frames.length - 1;
    const last = this.#frames[i];
    const afterNs = Math.max(0, timeNs - last.timeNs);
    const weights: Weights = [0, 0, 1, 0, 0];
    let { pose } = last.state;
    if (!last.asleep && i > 0 && this.#isSmooth(i - 1)) {
      const movedNs = kGoOnNs * (1 - Math.exp(-afterNs / kGoOnNs));
      this.#addSlope(i, i, movedNs, weights);
      pose = interpolatePose(this.#frames[i - 1].state.pose, pose, 1 + movedNs / this.#durationNs(i - 1), rigidPose());
    }
    const waited = afterNs - Math.max(kFreezeNs, 2 * last.stepNs);
    const left = last.asleep ? 1 : 1 - smoothstep(0, kEaseToRestNs, waited);
    for (let w = 0; w < weights.length; ++w) weights[w] *= left;
    const { level, basis } = last.state;
    return { pose, level, coefficients: basis ? this.#blended(i, weights) : kNone, basis };
  }

  /** The curve has changed: shows the same as before, and eases onto it. */
  #correct(gapNs: number): void {
    const curve = this.#curveAt(this.#timeNs);
    const shown = this.#shown;
    const durationNs = Math.min(Math.max(gapNs, kCorrectNsMin), kCorrectNsMax);
    this.#correction = areJoined(shown, curve) ? { shown, curve, begunNs: this.#timeNs, durationNs } : null;
  }

  #corrected(state: State): State {
    if (!this.#correction) return state;
    const { shown, curve, begunNs, durationNs } = this.#correction;
    const left = 1 - smoothstep(0, durationNs, this.#timeNs - begunNs);
    const basis = shown.basis ?? curve.basis;
    if (left <= 0 || (basis && state.basis && basis !== state.basis)) {
      this.#correction = null;
      return state;
    }
    const pose = movePose(state.pose, curve.pose, shown.pose, left, rigidPose());
    if (!basis) return { ...state, pose };
    const count = Math.max(state.coefficients.length, shown.coefficients.length, curve.coefficients.length);
    const coefficients = new Float32Array(count);
    coefficients.set(state.coefficients);
    const share = Math.fround(left);
    for (let k = 0; k < shown.coefficients.length; ++k) coefficients[k] += share * shown.coefficients[k];
    for (let k = 0; k < curve.coefficients.length; ++k) coefficients[k] -= share * curve.coefficients[k];
    return { pose, level: state.level, coefficients, basis };
  }
}

const kNone = new Float32Array(0);

function areJoined(from: State, to: State): boolean {
  return from.basis === to.basis || !from.basis || !to.basis;
}
