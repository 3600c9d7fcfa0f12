import { displacementsOf, type HairBasis } from "./basis";
import type { Frame } from "./frame";
import type { LevelGeometry } from "./lattice";
import { LevelIndex } from "./level";
import { interpolatePose, rigidPose, type Pose } from "./pose";
import { smoothstep } from "./smoothstep";

const kFramesMax = 256; // stored while no caller samples
const kArrivalsMax = 60; // two seconds at 30 Hz
const kIntervalDefaultNs = 33_333_333;
const kFreezeNs = 100_000_000;
const kEaseToRestNs = 500_000_000;
// The delay changes by at most this share of the elapsed time: motion becomes slower or faster, but too little to
// notice.
const kSlewMax = 0.1;

/** The state to draw at one moment. The play-out owns its arrays; they are valid until its next call. */
export interface PlayoutSample {
  readonly pose: Pose;
  /** that the server steps */
  readonly level: LevelIndex;
  /** 3 an active node of `geometry`, head space, m; empty: at rest */
  readonly displacement: Float32Array;
  /** the sample time that is shown; never decreases */
  readonly timeNs: number;
  /** of the displacement; null: at rest */
  readonly geometry: LevelGeometry | null;
}

interface BufferedFrame extends Pick<Frame, "discontinuous" | "asleep" | "pose" | "level" | "coefficients" | "basis"> {
  readonly timeNs: number;
  /** from one step of the character to the next; 0: not known */
  readonly stepNs: number;
}

/**
 * The jitter buffer of one character: plays its frames smoothly, with a small delay behind the newest. It interpolates
 * between two frames; when no frame comes it freezes for 100 ms, or for two steps of the character if that is longer,
 * then eases to rest; a sleeping character stays frozen until it wakes. Time is an argument, always on the client's
 * clock, ns.
 *
 * Between two frames, coefficients move along the parabola through the frame before as well, or in a straight line where
 * there is none.
 *
 * The lateness of a frame is its arrival time minus its sample time. The play-out delay is the smallest lateness of the
 * last frames, plus one frame interval (to have a frame to interpolate to), plus the larger of their jitter and half an
 * interval.
 */
export class Playout {
  /** by time; at most one at or before the play time once sampled */
  readonly #frames: BufferedFrame[] = [];
  /** the frame before the first of these */
  #before: BufferedFrame | null = null;
  /** of the last frames, by arrival */
  readonly #arrivals: { readonly timeNs: number; readonly latenessNs: number }[] = [];
  // What is shown, of the last sample().
  #timeNs = 0;
  readonly #pose = rigidPose();
  #level = LevelIndex.rigid;
  #coefficients = new Float32Array(0);
  #basis: HairBasis | null = null;
  #displacement = new Float32Array(0);
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
   * frames that are not newer than the play time. Keeps the frame's arrays.
   */
  push(frame: Frame, sampleTimeNs: number, arrivalTimeNs: number): void {
    this.#recordArrival(sampleTimeNs, arrivalTimeNs);
    const frames = this.#frames;
    const isDuplicate = frames.some((each) => each.timeNs === sampleTimeNs);
    if (isDuplicate || (this.#started && sampleTimeNs <= this.#timeNs)) {
      ++this.#droppedCount;
      return;
    }
    // After a gap, interpolate to the new frame from the shown state, not from the frame before the gap.
    if (this.#started && frames.length > 0 && frames[frames.length - 1].timeNs < this.#timeNs) {
      frames.splice(0, frames.length, this.#shown());
      this.#before = null;
    }
    const { discontinuous, asleep, pose, level, coefficients, basis } = frame;
    const stepNs = Math.round(1e9 * frame.stepS);
    const place = frames.filter((each) => each.timeNs < sampleTimeNs).length;
    const buffered = { timeNs: sampleTimeNs, discontinuous, asleep, pose, level, coefficients, stepNs, basis };
    frames.splice(place, 0, buffered);
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
    const frames = this.#frames;
    const last = frames.pop();
    if (!last) return;
    // The shown state may already be easing.
    const isShown = this.#started && this.#timeNs >= last.timeNs;
    frames.push({ ...last, asleep: true, coefficients: isShown ? this.#coefficients.slice() : last.coefficients });
  }

  /**
   * Returns what to draw at `renderTimeNs`; a time before the last one counts as the last one. Null until the first
   * frame.
   */
  sample(renderTimeNs: number): PlayoutSample | null {
    const frames = this.#frames;
    if (frames.length === 0) return null;
    this.#advance(renderTimeNs);
    while (frames.length > 1 && frames[1].timeNs <= this.#timeNs) this.#before = frames.shift()!;
    if (this.#timeNs <= frames[0].timeNs || frames.length === 1) this.#showLast(frames[0]);
    else this.#showBetween(frames[0], frames[1]);
    const basis = this.#basis;
    const numbers = basis ? 3 * basis.basis.nodeCount : 0;
    if (this.#displacement.length !== numbers) this.#displacement = new Float32Array(numbers);
    if (basis) displacementsOf(basis.basis, this.#coefficients, this.#displacement);
    return {
      pose: this.#pose,
      level: this.#level,
      displacement: this.#displacement,
      timeNs: this.#timeNs,
      geometry: basis?.geometry ?? null,
    };
  }

  #shown(): BufferedFrame {
    return {
      timeNs: this.#timeNs,
      discontinuous: false,
      asleep: false,
      pose: this.#pose.slice(),
      level: this.#level,
      coefficients: this.#coefficients.slice(),
      stepNs: 0,
      basis: this.#basis,
    };
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

  /**
   * With h_0 and h the durations before and after `from`, and d_0 and d the slopes of the straight lines, the parabola is
   *
   *   c(s) = c_from + s (c_to - c_from) + s (s - 1) h^2 (d - d_0) / (h_0 + h).
   */
  #showBetween(from: BufferedFrame, to: BufferedFrame): void {
    if (!areJoined(from, to)) return this.#show(from, 1);
    const durationNs = to.timeNs - from.timeNs;
    const s = (this.#timeNs - from.timeNs) / durationNs;
    interpolatePose(from.pose, to.pose, s, this.#pose);
    this.#level = to.level;
    this.#basis = to.basis ?? from.basis;
    const before = this.#before && areJoined(this.#before, from) ? this.#before : null;
    const durationBeforeNs = before ? from.timeNs - before.timeNs : durationNs;
    const ratio = durationNs / durationBeforeNs;
    const bend = (s * (s - 1) * durationNs) / (durationBeforeNs + durationNs);
    const shown = this.#resized(Math.max(from.coefficients.length, to.coefficients.length));
    for (let k = 0; k < shown.length; ++k) {
      const start = from.coefficients[k] ?? 0;
      const step = (to.coefficients[k] ?? 0) - start;
      const stepBefore = before ? start - (before.coefficients[k] ?? 0) : step;
      shown[k] = start + s * step + bend * (step - ratio * stepBefore);
    }
  }

  #showLast(last: BufferedFrame): void {
    const waited = this.#timeNs - last.timeNs - Math.max(kFreezeNs, 2 * last.stepNs);
    this.#show(last, last.asleep ? 1 : 1 - smoothstep(0, kEaseToRestNs, waited));
  }

  /** `left`: the share of its displacement. */
  #show({ pose, level, coefficients, basis }: BufferedFrame, left: number): void {
    this.#pose.set(pose);
    this.#level = level;
    this.#basis = basis;
    const shown = this.#resized(coefficients.length);
    for (let k = 0; k < shown.length; ++k) shown[k] = left * coefficients[k];
  }

  #resized(count: number): Float32Array {
    if (this.#coefficients.length !== count) this.#coefficients = new Float32Array(count);
    return this.#coefficients;
  }
}

function areJoined(from: BufferedFrame, to: BufferedFrame): boolean {
  return !to.discontinuous && (from.basis === to.basis || !from.basis || !to.basis);
}
