import { kHairStateIntegersMax, kHairStateStepMaxM } from "../generated/limits";
import { displacementsOf, type HairBasis } from "../hair/basis";
import { nodePosition } from "../hair/lattice";
import type { Pose } from "../hair/pose";
import { turned, type Rotation, type Vector } from "./codec/poseCode";
import * as fb from "./generated/messages";
import { invalid, type Builder, type Offset } from "./messageCodec";

/**
 * The finest lattice as its owner last had it, in the axes of the head: displacement = stepM * integer, velocity of the
 * node in the world = 32 stepM/s * integer, 3 an active node.
 */
export interface HairState {
  readonly stepM: number;
  readonly displacements: Int16Array;
  /** as many, or none: at rest */
  readonly velocities: Int16Array;
}

/** The hair of one character at one moment. */
export interface HairMoment {
  readonly timeNs: number;
  readonly pose: Pose;
  readonly basis: HairBasis;
  readonly coefficients: Float32Array;
}

const kStepM = Math.fround(0.25e-3);
const kVelocityStepsPerS = 32;
const kVelocityOverNsMax = 250e6;

/** The state at `now`, with velocities since `before`, if that has the same basis and is not long ago. */
export function hairStateOf(now: HairMoment, before: HairMoment | null): HairState {
  const displacement = nodesOf(now);
  const durationNs = before ? now.timeNs - before.timeNs : 0;
  const isRecent = before?.basis === now.basis && durationNs > 0 && durationNs <= kVelocityOverNsMax;
  const velocities = new Int16Array(isRecent ? displacement.length : 0);
  const displacements = Int16Array.from(displacement, (each) => toInteger(each / kStepM));
  const state = { stepM: kStepM, displacements, velocities };
  if (!isRecent) return state;
  const displacementBefore = nodesOf(before);
  const { lattice, activeNodes } = now.basis.geometry;
  const rest = new Float64Array(3);
  const [x, y, z, w] = now.pose;
  const perUnit = 1 / (1e-9 * durationNs * kVelocityStepsPerS * kStepM);
  activeNodes.forEach((node, n) => {
    nodePosition(lattice, node, rest);
    const to = placeOf(now.pose, rest, displacement, 3 * n);
    const from = placeOf(before.pose, rest, displacementBefore, 3 * n);
    const moved = turned([-x, -y, -z, w], [to[0] - from[0], to[1] - from[1], to[2] - from[2]]);
    for (let axis = 0; axis < 3; ++axis) velocities[3 * n + axis] = toInteger(moved[axis] * perUnit);
  });
  return state;
}

function nodesOf({ basis: { basis }, coefficients }: HairMoment): Float32Array {
  const displacement = new Float32Array(3 * basis.nodeCount);
  displacementsOf(basis, coefficients, displacement);
  return displacement;
}

/** Of a node in the world. */
function placeOf(pose: Pose, rest: Float64Array, displacement: Float32Array, at: number): Vector {
  const inHead: Vector = [rest[0] + displacement[at], rest[1] + displacement[at + 1], rest[2] + displacement[at + 2]];
  const [x, y, z] = turned([...pose.subarray(0, 4)] as unknown as Rotation, inHead);
  return [x + pose[4], y + pose[5], z + pose[6]];
}

function toInteger(units: number): number {
  return Math.min(Math.max(Math.round(units), -32767), 32767);
}

function writeShorts(to: Builder, integers: Int16Array): Offset {
  to.startVector(2, integers.length, 2);
  for (let i = integers.length - 1; i >= 0; --i) to.addInt16(integers[i]);
  return to.endVector();
}

/** @internal Types of the package do not show generated code. */
export function writeState(to: Builder, state: HairState): Offset {
  const displacements = writeShorts(to, state.displacements);
  const velocities = writeShorts(to, state.velocities);
  return fb.HairState.createHairState(to, displacements, velocities, state.stepM);
}

/** @internal Types of the package do not show generated code. */
export function readState(from: fb.HairState): HairState {
  const count = from.displacementsLength();
  if (count > kHairStateIntegersMax) throw invalid(`hair state: more than ${kHairStateIntegersMax} integers`);
  if (from.velocitiesLength() !== 0 && from.velocitiesLength() !== count) throw invalid("hair state: counts differ");
  return {
    stepM: from.stepM(),
    displacements: from.displacementsArray()!.slice(),
    velocities: from.velocitiesArray()!.slice(),
  };
}

export function checkState({ stepM, displacements, velocities }: HairState): void {
  const count = displacements.length;
  if (count === 0 || count % 3 !== 0 || count > kHairStateIntegersMax)
    throw invalid("hair state: not 3 integers a node, or too many");
  if (velocities.length !== 0 && velocities.length !== count) throw invalid("hair state: counts differ");
  if (!(stepM > 0 && stepM <= kHairStateStepMaxM)) throw invalid("hair state: step not in (0, 0.001] m");
}
