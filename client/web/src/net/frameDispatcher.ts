import type { Frame } from "../hair/frame";
import type { LevelGeometry } from "../hair/lattice";
import { ErrorClass, LevelIndex } from "../hair/level";
import { rigidPose } from "../hair/pose";
import type { FrameBatch, FrameSink } from "./events";
import type { LastKnownHair } from "./lastKnownHair";
import type { DecodedFrame } from "./members";
import type { CodedFrame, CodedFrameBatch } from "./messages";

const kNothing: Int16Array = new Int16Array(0);

/** Hands decoded frames on: to a sink as they are, or copied into a batch. */
export class FrameDispatcher {
  sink: FrameSink | null = null;
  tickRateHz = 30;
  #tick = 0;
  #sampleTimeNs = 0;
  #frames: Frame[] = [];
  /** the one object that every sink call gets */
  readonly #shown = {
    member: 0,
    character: 0,
    level: LevelIndex.rigid,
    errorClass: ErrorClass.halfMm,
    discontinuous: false,
    asleep: false,
    lastKnown: false,
    stepStride: 1,
    stepS: 0,
    pose: rigidPose(),
    displacements: kNothing,
    velocities: kNothing,
    geometry: null as LevelGeometry | null,
  };

  constructor(private readonly lastKnown: LastKnownHair) {}

  begin(batch: CodedFrameBatch): void {
    this.#tick = batch.tick;
    this.#sampleTimeNs = batch.sampleTimeNs;
    this.#frames = [];
  }

  /** Of outcome "decoded". */
  pass(frame: CodedFrame, decoded: DecodedFrame, nowNs: number): void {
    const shown = this.#shown;
    shown.member = frame.member;
    shown.character = decoded.character;
    shown.level = decoded.level;
    shown.errorClass = decoded.errorClass;
    shown.discontinuous = decoded.discontinuous;
    shown.asleep = frame.asleep;
    shown.lastKnown = false;
    shown.stepStride = frame.stepStride;
    shown.stepS = frame.stepStride / this.tickRateHz;
    shown.pose = decoded.pose!;
    shown.displacements = decoded.integers!.nodes;
    shown.velocities = decoded.integers!.velocities;
    shown.geometry = decoded.geometry;
    if (shown.character !== 0 && shown.level === LevelIndex.rigid) this.#showLastKnown(nowNs);
    if (this.sink) {
      this.sink(shown, this.#sampleTimeNs, this.#tick);
      return;
    }
    this.#frames.push({
      ...shown,
      pose: shown.pose.slice(),
      displacements: shown.displacements.slice(),
      velocities: shown.velocities.slice(),
    });
  }

  /** What was not given to a sink; null when there is nothing. */
  finish(): FrameBatch | null {
    if (this.#frames.length === 0) return null;
    const frames = this.#frames;
    this.#frames = [];
    return { type: "frameBatch", tick: this.#tick, sampleTimeNs: this.#sampleTimeNs, frames };
  }

  #showLastKnown(nowNs: number): void {
    const hair = this.lastKnown.of(this.#shown.character, nowNs);
    if (!hair) return;
    this.#shown.lastKnown = true;
    this.#shown.level = hair.state.level;
    this.#shown.errorClass = hair.errorClass;
    this.#shown.displacements = hair.state.displacements;
    this.#shown.velocities = kNothing;
    this.#shown.geometry = hair.geometry;
  }
}
