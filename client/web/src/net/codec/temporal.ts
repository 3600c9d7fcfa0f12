import type { History } from "./frameIntegers";

/** Frames of the history that are used, and eighths of the first and the second difference. */
export type TemporalWeights = readonly [frames: number, first: number, second: number];

/** The number of bits that select the weights, by order. */
export const kTemporalBits: readonly number[] = [0, 1, 3, 4];

/** Those a frame can choose from, by order. */
// biome-ignore format: the table reads as one row for each order.
export const kTemporalWeights: readonly (readonly TemporalWeights[])[] = [
  [[0, 0, 0]],
  [[1, 0, 0], [0, 0, 0]],
  [[2, 8, 0], [2, 7, 0], [2, 6, 0], [2, 5, 0], [2, 4, 0], [2, 2, 0], [1, 0, 0], [0, 0, 0]],
  [
    [3, 8, 8], [3, 8, 6], [3, 8, 4], [3, 8, 0], [3, 7, 8], [3, 7, 6], [3, 7, 4], [3, 6, 8],
    [3, 6, 6], [3, 6, 4], [3, 6, 2], [3, 5, 6], [3, 5, 4], [2, 4, 0], [1, 0, 0], [0, 0, 0],
  ],
];

const kMotionMax = 8191;

const w16 = (x: number): number => (x << 16) >> 16;

/**
 * What `numbers` coordinates are expected to be, modulo 2^16, and the size of the highest difference that the history
 * has, one a node.
 */
export function predictNodes(
  history: History,
  weights: TemporalWeights,
  numbers: number,
  predicted: Int16Array,
  motion: Uint16Array,
): void {
  const [frames, f, s] = weights;
  if (frames < 2) {
    for (let i = 0; i < numbers; ++i) predicted[i] = frames === 0 ? 0 : history[0].nodes[i];
    motion.fill(0, 0, numbers / 3);
    return;
  }
  const a = history[0].nodes;
  const b = history[1].nodes;
  const c = frames > 2 ? history[2].nodes : null;
  for (let i = 0; i < numbers; i += 3) {
    let size = 0;
    for (let n = i; n < i + 3; ++n) {
      const first = w16(a[n] - b[n]);
      if (c) {
        const second = w16(first - w16(b[n] - c[n]));
        predicted[n] = a[n] + (w16(w16(f * first) + w16(s * second) + 4) >> 3);
        size += Math.abs(second);
      } else {
        predicted[n] = a[n] + (w16(w16(f * first) + 4) >> 3);
        size += Math.abs(first);
      }
    }
    motion[i / 3] = size < kMotionMax ? size : kMotionMax;
  }
}
