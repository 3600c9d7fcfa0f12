import type { BitReader } from "./bits";
import type { FrameIntegers, History } from "./frameIntegers";
import { kBoneIntegers, kIntegersPerBone } from "./frameIntegers";
import { takeExponential, unfold32 } from "./golomb";

// The pose of a frame (schema/codec/README.md, Bones). All sums are modulo 2^32.

const kRotation = 3; // where a bone's quaternion begins
const kOne = 1 << 15;

const predicted = new Int32Array(kBoneIntegers);
const error = new Int32Array(kIntegersPerBone);

/** Reads beyond the end decode to something; the reader knows. */
export function decodeBones(reader: BitReader, history: History, order: number, frame: FrameIntegers): void {
  const choice = reader.take(2);
  const chainPositions = reader.take(1) !== 0;
  const chainRotations = reader.take(1) !== 0;
  const kPositions = reader.take(5);
  const kRotations = reader.take(5);
  predict(history, order, choice);
  error.fill(0);
  const { bones } = frame;
  for (let at = 0; at < kBoneIntegers; at += kIntegersPerBone) {
    let largest: number;
    let negative: boolean;
    if (order === 0) {
      largest = reader.take(2);
      negative = reader.take(1) !== 0;
    } else {
      largest = largestOf(at + kRotation);
      negative = predicted[at + kRotation + largest] < 0;
    }
    const implied = kRotation + largest;
    for (let c = 0; c < kIntegersPerBone; ++c) {
      if (c === implied) continue;
      const isPosition = c < kRotation;
      const chained = isPosition ? chainPositions : chainRotations;
      const z = takeExponential(reader, isPosition ? kPositions : kRotations);
      bones[at + c] = predicted[at + c] + (chained ? error[c] : 0) + unfold32(z);
      error[c] = bones[at + c] - predicted[at + c];
    }
    const root = impliedBy(bones, at + kRotation, largest);
    bones[at + implied] = (negative ? -root : root) + unfold32(takeExponential(reader, 0));
    error[implied] = bones[at + implied] - predicted[at + implied];
  }
}

function predict(history: History, order: number, choice: number): void {
  if (order === 0) {
    predicted.fill(0);
    return;
  }
  const a = history[0].bones;
  const b = order > 1 ? history[1].bones : a;
  const c = order > 2 ? history[2].bones : null;
  for (let i = 0; i < kBoneIntegers; ++i) {
    const first = (a[i] - b[i]) | 0;
    const second = c ? (first - ((b[i] - c[i]) | 0)) | 0 : 0;
    let value = a[i];
    if (choice >= 1) value += first;
    if (choice === 2) value += second >> 1;
    if (choice === 3) value += second;
    predicted[i] = value;
  }
}

/** The component of the predicted quaternion at `at` that is largest in absolute value, the first of equal ones. */
function largestOf(at: number): number {
  let largest = 0;
  for (let c = 1; c < 4; ++c) {
    if (Math.abs(predicted[at + c]) > Math.abs(predicted[at + largest])) largest = c;
  }
  return largest;
}

/** What is left of length 1 by the three other components. */
function impliedBy(bones: Int32Array, at: number, largest: number): number {
  let rest = kOne * kOne;
  for (let c = 0; c < 4; ++c) {
    if (c === largest) continue;
    const value = Math.min(Math.max(bones[at + c], -kOne), kOne);
    rest -= value * value;
  }
  return Math.floor(Math.sqrt(Math.max(rest, 0)));
}
