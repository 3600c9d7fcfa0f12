import { kLearntHiddenMax, kLearntModesMax, kLearntStartTicks, kLearntWeightMax } from "../generated/constants";
import { HairnetError } from "./hairnetError";
import { interpolatePose, rigidPose, type Pose } from "./pose";
import { kPoseInputCount, PoseHistory } from "./poseInputs";

// The hair of one groom as a small recurrent network, from poses to the first coefficients of the groom's basis:
// core/learnt/learnt_hair.hpp, whose numbers these are within the rounding of floats.

/** Rows of matrices follow each other; gates are z, n, r. Immutable. */
export interface LearntWeights {
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

/** With its matrices as `multiply` reads them. */
export interface LearntHair extends LearntWeights {
  readonly packed: { readonly input: Float64Array; readonly hidden: Float64Array; readonly output: Float64Array };
}

/** Throws `HairnetError` unless counts agree and all weights are in range. */
export function makeLearntHair(weights: LearntWeights): LearntHair {
  validate(weights);
  const { hiddenCount, inputWeights, hiddenWeights, outputWeights } = weights;
  const input = packByFours(inputWeights, kPoseInputCount);
  const hidden = packByFours(hiddenWeights, hiddenCount);
  return { ...weights, packed: { input, hidden, output: packByFours(outputWeights, hiddenCount) } };
}

function validate(weights: LearntWeights): void {
  const isCount = (count: number, most: number) => count > 0 && count <= most && count % 4 === 0;
  const { hiddenCount, modeCount, inputWeights, hiddenWeights, bias, outputWeights } = weights;
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
  for (const each of [inputWeights, hiddenWeights, bias, outputWeights])
    if (!each.every(isWeight)) throw invalid("a weight that is not finite, or too great");
  const isSize = (value: number) => Number.isFinite(value) && value >= 0;
  if (weights.most.length !== kPoseInputCount || !weights.most.every(isSize)) throw invalid("a wrong range of inputs");
  if (!isSize(weights.error) || !isSize(weights.lowError)) throw invalid("a wrong error");
}

function invalid(what: string): HairnetError {
  return new HairnetError("invalid", `learnt hair with ${what}`);
}

/** What one character remembers. */
export class LearntState {
  readonly poses = new PoseHistory();
  readonly hidden: Float64Array;

  constructor(hair: LearntHair) {
    this.hidden = new Float64Array(hair.hiddenCount);
  }
}

const inputs = new Float64Array(kPoseInputCount);
const ofInputs = new Float64Array(3 * kLearntHiddenMax);
const ofHidden = new Float64Array(3 * kLearntHiddenMax);
const driven = new Float64Array(kLearntModesMax);
const between = rigidPose();

/** One tick: `pose` follows `kLearntTickS` after the last. Writes the coefficients (m) that the network drives. */
export function stepLearnt(hair: LearntHair, state: LearntState, pose: Pose, out: Float32Array): void {
  state.poses.next(pose, inputs);
  const { hiddenCount: n, bias } = hair;
  const { hidden } = state;
  multiply(hair.packed.input, 3 * n, inputs, ofInputs);
  multiply(hair.packed.hidden, 3 * n, hidden, ofHidden);
  for (let i = 0; i < n; ++i) {
    const [zRow, nRow, rRow] = [i, n + i, 2 * n + i];
    const z = gate(bias[zRow] + ofInputs[zRow] + ofHidden[zRow]);
    const r = gate(bias[rRow] + ofInputs[rRow] + ofHidden[rRow]);
    const target = squash(bias[nRow] + ofInputs[nRow] + r * ofHidden[nRow]) - squash(bias[nRow]);
    hidden[i] += z * (target - hidden[i]);
  }
  multiply(hair.packed.output, hair.modeCount, hidden, driven);
  for (let k = 0; k < hair.modeCount; ++k) out[k] = driven[k];
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

// A crowd has thousands of products a second. In doubles nothing is converted; four sums do not wait for each other, and
// with four rows side by side memory is read in one direction.

/** Rows of `columns` numbers, four by four: the first numbers of four rows, then their second ones. */
function packByFours(rows: Float32Array, columns: number): Float64Array {
  const out = new Float64Array(rows.length);
  for (let i = 0; i < rows.length; ++i) {
    const row = Math.floor(i / columns);
    out[(row - (row % 4)) * columns + 4 * (i % columns) + (row % 4)] = rows[i];
  }
  return out;
}

/** The product of a matrix, as `packByFours` made it, with `numbers`, one a column. */
function multiply(matrix: Float64Array, rows: number, numbers: Float64Array, out: Float64Array): void {
  let at = 0;
  for (let row = 0; row < rows; row += 4) {
    let a = 0;
    let b = 0;
    let c = 0;
    let d = 0;
    for (let i = 0; i < numbers.length; ++i, at += 4) {
      const number = numbers[i];
      a += matrix[at] * number;
      b += matrix[at + 1] * number;
      c += matrix[at + 2] * number;
      d += matrix[at + 3] * number;
    }
    out[row] = a;
    out[row + 1] = b;
    out[row + 2] = c;
    out[row + 3] = d;
  }
}

function squash(x: number): number {
  const a = Math.min(Math.max(x, -3), 3);
  return (a * (27 + a * a)) / (27 + 9 * a * a);
}

function gate(x: number): number {
  return 0.5 + 0.5 * squash(x);
}
