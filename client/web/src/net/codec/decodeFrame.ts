import { BitReader } from "./bits";
import { decodeBones } from "./bones";
import { NodeScratch, decodeNodes, kDisplacementExpectation, kVelocityExpectation } from "./decodeNodes";
import type { FrameIntegers, History } from "./frameIntegers";
import { kHistoryMax } from "./frameIntegers";
import type { Neighbours } from "./neighbours";
import { kTemporalBits, kTemporalWeights, predictNodes } from "./temporal";

const kVelocityScaleBits = 7;

const reader = new BitReader();
const scratch = new NodeScratch();

/**
 * For any bytes: true and the integers that were encoded, or false (then `out` is unspecified). `content` is exactly one
 * frame's; bytes too many are refused. The first `order` of `history` are the encoder's, the newest first, none of them
 * `out`. `neighbours`: of the frame's level; null exactly when it has no nodes. Allocates nothing after warm-up.
 */
export function decodeFrame(
  content: Uint8Array,
  history: History,
  order: number,
  neighbours: Neighbours | null,
  hasVelocities: boolean,
  out: FrameIntegers,
): boolean {
  const nodeCount = neighbours ? neighbours.nodeCount : 0;
  const numbers = 3 * nodeCount;
  if (order > kHistoryMax || order > history.length) return false;
  for (let n = 0; n < order; ++n) {
    if (history[n].nodes.length !== numbers) return false;
  }
  out.resize(numbers, hasVelocities ? numbers : 0);
  reader.reset(content);
  decodeBones(reader, history, order, out);
  if (neighbours && nodeCount > 0 && !decodePlanes(history, order, neighbours, hasVelocities, out)) return false;
  return reader.endsHere();
}

function decodePlanes(
  history: History,
  order: number,
  neighbours: Neighbours,
  hasVelocities: boolean,
  out: FrameIntegers,
): boolean {
  const numbers = 3 * neighbours.nodeCount;
  scratch.fit(neighbours.nodeCount);
  const weights = kTemporalWeights[order][reader.take(kTemporalBits[order])];
  predictNodes(history, weights, numbers, scratch.predicted, scratch.motion);
  if (!decodeNodes(reader, neighbours, kDisplacementExpectation[weights[0]], scratch, out.nodes)) return false;
  if (!hasVelocities) return true;
  const scale = order === 0 ? 0 : reader.take(kVelocityScaleBits);
  scratch.motion.fill(0, 0, neighbours.nodeCount);
  for (let i = 0; i < numbers; ++i)
    scratch.predicted[i] = order === 0 ? 0 : ((out.nodes[i] - history[0].nodes[i]) * scale) >> 4;
  return decodeNodes(reader, neighbours, kVelocityExpectation, scratch, out.velocities);
}
