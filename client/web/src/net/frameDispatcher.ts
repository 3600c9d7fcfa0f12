import type { Frame } from "../hair/frame";
import type { LevelGeometry } from "../hair/lattice";
import { ErrorClass, Level } from "../hair/level";
import { rigidPose } from "../hair/pose";
import type { FrameBatch, FrameSink } from "./events";
import type { KeptHair } from "./lastKnownHair";
import type { Taken } from "./members";
import type { CodedFrame, CodedFrameBatch } from "./messages";

const kNothing: Int16Array = new Int16Array(0);

/** Hands decoded frames on: to a sink as they are, or copied into a batch. */
export class FramePasser {
  sink: FrameSink | null = null;
  tickRateHz = 30;
  #tick = 0;
  #sampleTimeNs = 0;
  #frames: Frame[] = [];
  /** the one object that every sink call gets */
  readonly #shown = {
    member: 0,
    character: 0,
    level: Level.rigid,
    errorClass: ErrorClass.normal,
    discontinuous: false,
    asleep: false,
    kept: false,
    stepStride: 1,
    stepS: 0,
    pose: rigidPose(),
    displacements: kNothing,
    velocities: kNothing,
    geometry: null as LevelGeometry | null,
  };

  constructor(private readonly kept: KeptHair) {}

  begin(batch: CodedFrameBatch): void {
    this.#tick = batch.tick;
    this.#sampleTimeNs = batch.sampleTimeNs;
    this.#frames = [];
  }

  /** `taken`: decoded. */
  pass(frame: CodedFrame, taken: Taken, nowNs: number): void {
    const shown = this.#shown;
    shown.member = frame.member;
    shown.character = taken.character;
    shown.level = frame.level;
    shown.errorClass = frame.errorClass;
    shown.discontinuous = taken.discontinuous;
    shown.asleep = frame.asleep;
    shown.kept = false;
    shown.stepStride = frame.stepStride;
    shown.stepS = frame.stepStride / this.tickRateHz;
    shown.pose = taken.pose!;
    shown.displacements = taken.integers!.nodes;
    shown.velocities = taken.integers!.velocities;
    shown.geometry = taken.geometry;
    if (shown.character !== 0 && shown.level === Level.rigid) this.#bringKept(nowNs);
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

  #bringKept(nowNs: number): void {
    const hair = this.kept.of(this.#shown.character, nowNs);
    if (!hair) return;
    this.#shown.kept = true;
    this.#shown.level = hair.state.level;
    this.#shown.errorClass = hair.errorClass;
    this.#shown.displacements = hair.state.displacements;
    this.#shown.velocities = kNothing;
    this.#shown.geometry = hair.geometry;
  }
}
