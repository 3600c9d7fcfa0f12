import { kLearntHiddenMax, kLearntModesMax, kLearntStartTicks, kLearntWeightMax } from "../generated/constants";
import { HairnetError } from "./hairnetError";
import { interpolatePose, rigidPose, type Pose } from "./pose";
import { kPoseInputCount, PoseHistory } from "./poseInputs";

// The hair of one groom as a small recurrent network, from poses to the first coefficients of the groom's basis:
// core/learnt/learnt_hair.hpp, whose numbers these are within the rounding of floats.

/** Rows of matrices follow each other; gates are z, n, r. Immutable. */
export interface LearntHair {
  /** multiples of 4 */
  readonly hiddenCount: number;
  readonly modeCount: number;
  /** [3 hidden][input] */
  readonly inputWeights: Float32Array;
  /** [3 hidden][hidden] */
  readonly hiddenWeights: Float32Array;
  /** [3 hidden] */
  readonly bias: Float32Array;
  /** [mode][hidden] */
  readonly outputWeights: Float32Array;
  /** the greatest size of each input in the training motions */
  readonly most: Float32Array;
  /** over the hair's motion, on held-out motions: of this and of the low level */
  readonly error: number;
  readonly lowError: number;
}

/** Throws `HairnetError` unless counts agree and all weights are in range. */
export function validateLearntHair(hair: LearntHair): void {
  const isCount = (count: number, most: number) => count > 0 && count <= most && count % 4 === 0;
  const { hiddenCount, modeCount, inputWeights, hiddenWeights, bias, outputWeights } = hair;
  if (!isCount(hiddenCount, kLearntHiddenMax)) throw invalid("a wrong number of hidden numbers");
  if (!isCount(modeCount, kLearntModesMax)) throw invalid("a wrong number of modes");
  const gates = 3 * hiddenCount;
  if (
    inputWeights.length !== gates * kPoseInputCount ||
    hiddenWeights.length !== gates * hiddenCount ||
    bias.length !== gates ||
    outputWeights.length !== modeCount * hiddenCount
  )
    throw invalid("a wrong number of weights");
  const isWeight = (weight: number) => Math.abs(weight) <= kLearntWeightMax;
  for (const weights of [inputWeights, hiddenWeights, bias, outputWeights])
    if (!weights.every(isWeight)) throw invalid("a weight that is not finite, or too great");
  const isSize = (value: number) => Number.isFinite(value) && value >= 0;
  if (hair.most.length !== kPoseInputCount || !hair.most.every(isSize)) throw invalid("a wrong range of inputs");
  if (!isSize(hair.error) || !isSize(hair.lowError)) throw invalid("a wrong error");
}

function invalid(what: string): HairnetError {
  return new HairnetError("invalid", `learnt hair with ${what}`);
}

/** What one character remembers. */
export class LearntState {
  readonly poses = new PoseHistory();
  readonly hidden: Float32Array;

  constructor(hair: LearntHair) {
    this.hidden = new Float32Array(hair.hiddenCount);
  }
}

const inputs = new Float32Array(kPoseInputCount);
const after = new Float32Array(kLearntHiddenMax);
const between = rigidPose();

/** One tick: `pose` follows `kLearntTickS` after the last. Writes the coefficients (m) that the network drives. */
export function stepLearnt(hair: LearntHair, state: LearntState, pose: Pose, out: Float32Array): void {
  state.poses.next(pose, inputs);
  const { hiddenCount: n, inputWeights: x, hiddenWeights: h, bias } = hair;
  const { hidden } = state;
  for (let i = 0; i < n; ++i) {
    const [zRow, nRow, rRow] = [i, n + i, 2 * n + i];
    const z = gate(bias[zRow] + ofInputs(x, zRow) + dot(h, zRow * n, hidden, n));
    const r = gate(bias[rRow] + ofInputs(x, rRow) + dot(h, rRow * n, hidden, n));
    const target = squash(bias[nRow] + ofInputs(x, nRow) + r * dot(h, nRow * n, hidden, n)) - squash(bias[nRow]);
    after[i] = hidden[i] + z * (target - hidden[i]);
  }
  for (let i = 0; i < n; ++i) hidden[i] = after[i];
  for (let k = 0; k < hair.modeCount; ++k) out[k] = dot(hair.outputWeights, k * n, hidden, n);
}

/** The motion of one character from a pose that its network has seen to a later one. */
export interface LearntMotion {
  readonly from: Pose;
  readonly to: Pose;
  /** from one to the other; poses between them are interpolated */
  readonly ticks: number;
  /** the network sees `from` held for `kLearntStartTicks` first */
  readonly begins: boolean;
}

export function stepLearntMotion(hair: LearntHair, state: LearntState, motion: LearntMotion, out: Float32Array): void {
  const { from, to, ticks, begins } = motion;
  if (begins) for (let tick = 0; tick < kLearntStartTicks; ++tick) stepLearnt(hair, state, from, out);
  for (let tick = 1; tick <= ticks; ++tick)
    stepLearnt(hair, state, tick === ticks ? to : interpolatePose(from, to, tick / ticks, between), out);
}

/** `count` is a multiple of 4. Four sums do not wait for each other. */
function dot(weights: Float32Array, at: number, numbers: Float32Array, count: number): number {
  let a = 0;
  let b = 0;
  let c = 0;
  let d = 0;
  for (let i = 0; i < count; i += 4) {
    a += weights[at + i] * numbers[i];
    b += weights[at + i + 1] * numbers[i + 1];
    c += weights[at + i + 2] * numbers[i + 2];
    d += weights[at + i + 3] * numbers[i + 3];
  }
  return a + b + (c + d);
}

function ofInputs(weights: Float32Array, row: number): number {
  return dot(weights, row * kPoseInputCount, inputs, kPoseInputCount);
}

function squash(x: number): number {
  const a = Math.min(Math.max(x, -3), 3);
  return (a * (27 + a * a)) / (27 + 9 * a * a);
}

function gate(x: number): number {
  return 0.5 + 0.5 * squash(x);
}
