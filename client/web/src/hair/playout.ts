import { dequantiseNodes, dequantiseVelocities } from "./dequantise";
import type { Frame } from "./frame";
import { HermiteLattice } from "./hermiteLattice";
import type { LevelGeometry } from "./lattice";
import { LevelIndex } from "./level";
import type { Pose } from "./pose";
import { interpolatePose, kPoseNumbers, rigidPose } from "./pose";
import { smoothstep } from "./smoothstep";

const kFramesMax = 256; // stored while no caller samples
const kSpareMax = 8;
const kArrivalsMax = 60; // two seconds at 30 Hz
const kIntervalDefaultNs = 33_333_333;
const kFreezeNs = 100_000_000;
const kCubicNsMax = 250_000_000;
const kEaseToRestNs = 500_000_000;
// The delay changes by at most this share of the elapsed time: motion becomes slower or faster, but too little to
// notice.
const kSlewMax = 0.1;

/** The state to draw at one moment. The play-out owns its arrays; they are valid until its next call. */
export interface PlayoutSample {
  readonly pose: Pose;
  readonly level: LevelIndex;
  /** 3 an active node of `geometry`, head space, m; empty: rigid */
  readonly displacement: Float32Array;
  /** the sample time that is shown; never decreases */
  readonly timeNs: number;
  /** of the displacement; null while there is none */
  readonly geometry: LevelGeometry | null;
}

class BufferedFrame {
  timeNs = 0;
  discontinuous = false;
  /** shown until a newer frame comes */
  asleep = false;
  readonly pose: Pose = rigidPose();
  level = LevelIndex.rigid;
  displacement = new Float32Array(0);
  /** of each node in the world, head axes, m/s, over the step that ended here; or empty */
  velocity = new Float32Array(0);
  /** of that step; 0: not known */
  stepNs = 0;
  geometry: LevelGeometry | null = null;
  #displacementRoom = new Float32Array(0);
  #velocityRoom = new Float32Array(0);

  /** Sets the counts of displacement and velocity; their values are undefined. */
  resize(displacements: number, velocities: number): void {
    if (this.displacement.length !== displacements) {
      if (this.#displacementRoom.length < displacements) this.#displacementRoom = new Float32Array(displacements);
      this.displacement = this.#displacementRoom.subarray(0, displacements);
    }
    if (this.velocity.length !== velocities) {
      if (this.#velocityRoom.length < velocities) this.#velocityRoom = new Float32Array(velocities);
      this.velocity = this.#velocityRoom.subarray(0, velocities);
    }
  }

  assign(other: BufferedFrame): void {
    this.timeNs = other.timeNs;
    this.discontinuous = other.discontinuous;
    this.asleep = other.asleep;
    this.pose.set(other.pose);
    this.level = other.level;
    this.resize(other.displacement.length, other.velocity.length);
    this.displacement.set(other.displacement);
    this.velocity.set(other.velocity);
    this.stepNs = other.stepNs;
    this.geometry = other.geometry;
  }
}

/**
 * The jitter buffer of one character: plays its frames smoothly, with a small delay behind the newest. It interpolates
 * between two frames; when no frame comes it freezes for a moment, then eases to rest; a sleeping character stays
 * frozen until it wakes. Time is an argument, always on the client's clock, ns.
 *
 * Between frames with velocities the hair moves along a cubic with these velocities (Hermite), otherwise in a straight
 * line.
 *
 * The lateness of a frame is its arrival time minus its sample time. The play-out delay is the smallest lateness of the
 * last frames, plus one frame interval (to have a frame to interpolate to), plus the larger of their jitter and half an
 * interval.
 */
export class Playout {
  /** by time; at most one at or before the play time once sampled */
  readonly #frames: BufferedFrame[] = [];
  /** no longer used, for reuse */
  readonly #spare: BufferedFrame[] = [];
  /** of the last frames, by arrival */
  readonly #arrivals: { timeNs: number; latenessNs: number }[] = [];
  readonly #intervals: number[] = [];
  /** the last result of sample() */
  readonly #shown = new BufferedFrame();
  readonly #head = new HermiteLattice();
  readonly #sample = {
    pose: this.#shown.pose,
    level: LevelIndex.rigid,
    displacement: this.#shown.displacement,
    timeNs: 0,
    geometry: null as LevelGeometry | null,
  };
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
   * frames that are not newer than the play time. Copies what it stores.
   */
  push(frame: Frame, sampleTimeNs: number, arrivalTimeNs: number): void {
    this.#recordArrival(sampleTimeNs, arrivalTimeNs);
    const frames = this.#frames;
    let place = frames.length;
    while (place > 0 && frames[place - 1].timeNs > sampleTimeNs) --place;
    const duplicate = place > 0 && frames[place - 1].timeNs === sampleTimeNs;
    if (duplicate || (this.#started && sampleTimeNs <= this.#shown.timeNs)) {
      ++this.#droppedCount;
      return;
    }
    // After a gap, interpolate to the new frame from the shown state, not from the frame before the gap.
    if (this.#started && frames.length > 0 && frames[frames.length - 1].timeNs < this.#shown.timeNs) {
      const from = this.#spare.pop() ?? new BufferedFrame();
      from.assign(this.#shown);
      from.discontinuous = false;
      for (const gone of frames.splice(0)) this.#release(gone);
      frames.push(from);
      place = 1;
    }
    const buffered = this.#spare.pop() ?? new BufferedFrame();
    buffered.timeNs = sampleTimeNs;
    buffered.discontinuous = frame.discontinuous;
    buffered.asleep = frame.asleep;
    buffered.pose.set(frame.pose.subarray(0, kPoseNumbers));
    buffered.level = frame.level;
    buffered.stepNs = Math.round(1e9 * frame.stepS);
    buffered.geometry = frame.geometry;
    buffered.resize(frame.displacements.length, frame.velocities.length);
    dequantiseNodes(frame.displacements, frame.errorClass, buffered.displacement);
    dequantiseVelocities(frame.velocities, frame.errorClass, buffered.velocity);
    frames.splice(place, 0, buffered);
    if (frames.length > kFramesMax) {
      this.#dropFirst();
      ++this.#droppedCount;
    }
  }

  /**
   * Freezes the shown state until the next frame arrives. For callers that know that no frame will come for a while, as
   * during a reconnect.
   */
  freeze(): void {
    if (this.#frames.length === 0) return;
    const last = this.#frames[this.#frames.length - 1];
    // The shown state may already be easing.
    if (this.#started && this.#shown.timeNs >= last.timeNs) {
      last.resize(this.#shown.displacement.length, last.velocity.length);
      last.displacement.set(this.#shown.displacement);
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
    this.#advance(renderTimeNs);
    const shown = this.#shown;
    while (frames.length > 1 && frames[1].timeNs <= shown.timeNs) this.#dropFirst();
    if (shown.timeNs <= frames[0].timeNs || frames.length === 1) this.#showLast(frames[0]);
    else this.#showBetween(frames[0], frames[1]);
    const sample = this.#sample;
    sample.level = shown.level;
    sample.displacement = shown.displacement;
    sample.timeNs = shown.timeNs;
    sample.geometry = shown.geometry;
    return sample;
  }

  #dropFirst(): void {
    this.#release(this.#frames.shift()!);
  }

  #release(buffered: BufferedFrame): void {
    if (this.#spare.length < kSpareMax) this.#spare.push(buffered);
  }

  #recordArrival(sampleTimeNs: number, arrivalTimeNs: number): void {
    const arrival = this.#arrivals.length < kArrivalsMax ? { timeNs: 0, latenessNs: 0 } : this.#arrivals.shift()!;
    arrival.timeNs = sampleTimeNs;
    arrival.latenessNs = arrivalTimeNs - sampleTimeNs;
    this.#arrivals.push(arrival);
    this.#target = null;
  }

  #targetDelayNs(): number {
    const arrivals = this.#arrivals;
    const intervals = this.#intervals;
    intervals.length = 0;
    let least = Infinity;
    let most = -Infinity;
    for (let i = 0; i < arrivals.length; ++i) {
      least = Math.min(least, arrivals[i].latenessNs);
      most = Math.max(most, arrivals[i].latenessNs);
      const interval = i > 0 ? arrivals[i].timeNs - arrivals[i - 1].timeNs : 0;
      if (interval > 0) intervals.push(interval);
    }
    intervals.sort(byValue);
    const median = intervals.length > 0 ? intervals[intervals.length >> 1] : kIntervalDefaultNs;
    const interval = Math.max(median, this.#frames[this.#frames.length - 1].stepNs);
    return least + interval + Math.max(Math.floor(interval / 2), most - least);
  }

  /** Advances the play time to `renderTimeNs`. */
  #advance(renderTimeNs: number): void {
    this.#target ??= this.#targetDelayNs();
    const target = this.#target;
    const shown = this.#shown;
    if (!this.#started) {
      this.#started = true;
      this.#renderTimeNs = renderTimeNs;
      this.#delayNs = target;
      shown.timeNs = renderTimeNs - target;
      return;
    }
    const elapsed = Math.max(0, renderTimeNs - this.#renderTimeNs);
    this.#renderTimeNs += elapsed;
    const starved = this.#frames[this.#frames.length - 1].timeNs < shown.timeNs;
    const slew = Math.floor(kSlewMax * elapsed);
    // There is no newer frame to show. Stop the play time here, so that late frames are in time again.
    if (starved && target > this.#delayNs) this.#delayNs = target;
    else this.#delayNs += Math.min(Math.max(target - this.#delayNs, -slew), slew);
    shown.timeNs = Math.max(shown.timeNs, this.#renderTimeNs - this.#delayNs);
  }

  #showBetween(from: BufferedFrame, to: BufferedFrame): void {
    const shown = this.#shown;
    shown.level = from.level;
    const count = from.displacement.length;
    const joined =
      !to.discontinuous &&
      to.level === from.level &&
      (to.displacement.length === count || to.displacement.length === 0 || count === 0);
    if (!joined) {
      shown.pose.set(from.pose);
      shown.resize(count, 0);
      shown.displacement.set(from.displacement);
      shown.geometry = from.geometry;
      return;
    }
    const s = (shown.timeNs - from.timeNs) / (to.timeNs - from.timeNs);
    interpolatePose(from.pose, to.pose, s, shown.pose);
    shown.geometry = to.geometry ?? from.geometry;
    if (isCubic(from, to)) return this.#showCubic(from, to, s);
    // An empty frame is a lattice at rest.
    shown.resize(Math.max(count, to.displacement.length), 0);
    const out = shown.displacement;
    const a = from.displacement;
    const b = to.displacement;
    for (let i = 0; i < out.length; ++i) out[i] = (a.length > 0 ? (1 - s) * a[i] : 0) + (b.length > 0 ? s * b[i] : 0);
  }

  #showCubic(from: BufferedFrame, to: BufferedFrame, s: number): void {
    const durationS = 1e-9 * (to.timeNs - from.timeNs);
    const stepS = Math.min(durationS, 1e-9 * to.stepNs);
    this.#shown.resize(to.displacement.length, 0);
    this.#head.set(from.pose, to.pose, durationS, stepS);
    this.#head.interpolate(from, to, to.geometry!, s, this.#shown.displacement);
  }

  #showLast(last: BufferedFrame): void {
    const shown = this.#shown;
    const waited = shown.timeNs - last.timeNs - Math.max(kFreezeNs, 2 * last.stepNs);
    const left = last.asleep ? 1 : 1 - smoothstep(0, kEaseToRestNs, waited);
    shown.pose.set(last.pose);
    shown.level = last.level;
    shown.geometry = last.geometry;
    shown.resize(last.displacement.length, 0);
    for (let i = 0; i < last.displacement.length; ++i) shown.displacement[i] = left * last.displacement[i];
  }
}

const byValue = (a: number, b: number): number => a - b;

/** Over a long gap the end velocities no longer describe the motion between, so the cubic is not used. */
function isCubic(from: BufferedFrame, to: BufferedFrame): boolean {
  const count = to.displacement.length;
  return (
    count > 0 &&
    to.velocity.length === count &&
    from.velocity.length === count &&
    from.displacement.length === count &&
    to.geometry !== null &&
    3 * to.geometry.activeNodes.length === count &&
    to.timeNs - from.timeNs <= kCubicNsMax
  );
}
