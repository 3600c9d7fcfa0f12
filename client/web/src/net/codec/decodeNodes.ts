import type { BitReader } from "./bits";
import { unfold16 } from "./golomb";
import type { Neighbours } from "./neighbours";

// The walk over the nodes of a frame, from the last to the first: each one's prediction corrected by the errors of its
// neighbours, and its Rice parameter chosen by the bits that they needed (schema/codec/README.md, Displacements).

export const kSpatialBits = 2;
/** In 32nds of the sum of the neighbours' errors, by how many there are; a frame chooses a row. */
const kSpatialWeights: readonly (readonly number[])[] = [
  [0, 0, 0, 0],
  [0, 12, 7, 4],
  [0, 22, 12, 8],
  [0, 33, 17, 11],
];
/** Of the neighbours' sizes, by how many there are: their mean's. */
const kSizeShares: readonly number[] = [6, 6, 3, 2];

/** Weights of the neighbours' sizes and of the node's motion in what is expected of its own size. */
export type Expectation = readonly [neighbours: number, motion: number];
/** By the number of frames that the prediction uses. */
export const kDisplacementExpectation: readonly Expectation[] = [
  [72, 0],
  [70, 0],
  [52, 60],
  [40, 150],
];
export const kVelocityExpectation: Expectation = [72, 0];
const kExpectationShift = 10;

const kZerosMax = 16;
const kSizeMax = 16383;

/** What decoding nodes needs besides the frame. Grows to the largest lattice and is then reused. */
export class NodeScratch {
  predicted = new Int16Array(0);
  motion = new Uint16Array(0);
  /** Node less prediction, 3 a node, and a node more that is zero: absent neighbours. */
  error = new Int16Array(3);
  size = new Uint16Array(1);

  fit(nodeCount: number): void {
    if (this.motion.length >= nodeCount) return;
    this.predicted = new Int16Array(3 * nodeCount);
    this.motion = new Uint16Array(nodeCount);
    this.error = new Int16Array(3 * nodeCount + 3);
    this.size = new Uint16Array(nodeCount + 1);
  }
}

/** A plane of nodes from `scratch.predicted` and the bits into `nodes`. False when the bits are at an end. */
export function decodeNodes(
  reader: BitReader,
  neighbours: Neighbours,
  expectation: Expectation,
  scratch: NodeScratch,
  nodes: Int16Array,
): boolean {
  const spatial = kSpatialWeights[reader.take(kSpatialBits)];
  const { nodeCount, counts, nodes: around } = neighbours;
  const { predicted, motion, error, size: sizes } = scratch;
  const [neighbourWeight, motionWeight] = expectation;
  error.fill(0, 3 * nodeCount, 3 * nodeCount + 3);
  sizes[nodeCount] = 0;
  let size = 0;
  for (let i = nodeCount - 1; i >= 0; --i) {
    const at = 3 * i;
    const count = counts[i];
    const a = around[at];
    const b = around[at + 1];
    const c = around[at + 2];
    const known = count === 0 ? size : sizes[a] + sizes[b] + sizes[c];
    const expectedSize = (known * kSizeShares[count] * neighbourWeight + motion[i] * motionWeight) >> kExpectationShift;

    let zx = 0;
    let zy = 0;
    let zz = 0;
    if (expectedSize !== 0 || reader.take(1) === 0) {
      const k = expectedSize === 0 ? 0 : 31 - Math.clz32(expectedSize);
      const x = takeZeros(reader);
      const y = takeZeros(reader);
      const z = takeZeros(reader);
      zx = x < kZerosMax ? (x << k) | reader.take(k) : reader.take(16);
      zy = y < kZerosMax ? (y << k) | reader.take(k) : reader.take(16);
      zz = z < kZerosMax ? (z << k) | reader.take(k) : reader.take(16);
      // Only malformed bytes need more than 16 bits.
      zx &= 0xffff;
      zy &= 0xffff;
      zz &= 0xffff;
    }
    size = Math.min(zx + zy + zz, kSizeMax);
    sizes[i] = size;

    const weight = spatial[count];
    nodes[at] = predicted[at] + correction(weight, error[3 * a] + error[3 * b] + error[3 * c]) + unfold16(zx);
    nodes[at + 1] =
      predicted[at + 1] + correction(weight, error[3 * a + 1] + error[3 * b + 1] + error[3 * c + 1]) + unfold16(zy);
    nodes[at + 2] =
      predicted[at + 2] + correction(weight, error[3 * a + 2] + error[3 * b + 2] + error[3 * c + 2]) + unfold16(zz);
    error[at] = nodes[at] - predicted[at];
    error[at + 1] = nodes[at + 1] - predicted[at + 1];
    error[at + 2] = nodes[at + 2] - predicted[at + 2];
    if (reader.isBeyondEnd()) return false;
  }
  return true;
}

function takeZeros(reader: BitReader): number {
  const zeros = reader.peekZeros(kZerosMax);
  reader.skip(zeros < kZerosMax ? zeros + 1 : kZerosMax);
  return zeros;
}

function correction(weight: number, errors: number): number {
  return (weight * errors + 16) >> 5;
}
