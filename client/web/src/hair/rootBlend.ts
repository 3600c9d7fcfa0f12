import type { Groom, PointRange } from "./groom";

/**
 * delta at lambda / lambda_0 >= 0 of a root-blend curve: (ratio, delta) pairs, or none for eq. 7 of the paper,
 * 1 - exp(-x^2). The curve begins at (0, 0), goes through all pairs without overshooting, and stays at the last.
 */
export function blendAt(curve: ArrayLike<number>, ratio: number): number {
  const count = curve.length >> 1;
  if (count === 0) return -Math.expm1(-ratio * ratio);
  let next = 1;
  while (next <= count && xOf(curve, next) <= ratio) ++next;
  if (next > count) return yOf(curve, count);
  const ax = xOf(curve, next - 1);
  const ay = yOf(curve, next - 1);
  const by = yOf(curve, next);
  const width = xOf(curve, next) - ax;
  const t = (ratio - ax) / width;
  const fromA = slopeAt(curve, next - 1) * width;
  const fromB = slopeAt(curve, next) * width;
  // Hermite cubic.
  const y = ay + t * t * (3 - 2 * t) * (by - ay) + t * (1 - t) * ((1 - t) * fromA - t * fromB);
  return Math.min(Math.max(y, ay), by);
}

// Point i of the curve; the first one is the origin.
const xOf = (curve: ArrayLike<number>, i: number) => (i === 0 ? 0 : curve[2 * i - 2]);
const yOf = (curve: ArrayLike<number>, i: number) => (i === 0 ? 0 : curve[2 * i - 1]);

/** The harmonic mean of the slopes on either side (Fritsch and Butland 1984), which keeps each cubic monotone. */
function slopeAt(curve: ArrayLike<number>, i: number): number {
  if (i === 0 || i === curve.length >> 1) return 0;
  const between = (n: number) => (yOf(curve, n + 1) - yOf(curve, n)) / (xOf(curve, n + 1) - xOf(curve, n));
  const before = between(i - 1);
  const after = between(i);
  return before + after > 0 ? (2 * before * after) / (before + after) : 0;
}

/** delta of every point of the groom: 0 moves rigidly with the head, 1 follows the lattice. */
export function rootBlend(groom: Groom): Float32Array {
  const delta = new Float32Array(groom.points.length / 3).fill(1);
  const curveOf = (group: number) => curveOfGroup(groom, group);
  const { strands, points } = groom;
  for (let s = 0; s < strands.count; ++s) {
    if (!strands.rooted[s] || strands.rootLengthM[s] <= 0) continue;
    blendLine(curveOf(strands.group[s]), strands.rootLengthM[s], points, strands.begin[s], strands.begin[s + 1], delta);
  }
  for (const thread of groom.threads) {
    if (!thread.rooted || thread.rootLengthM <= 0) continue;
    blendLine(curveOf(thread.group), thread.rootLengthM, points, thread.points.begin, thread.points.end, delta);
  }
  for (const card of groom.cards) {
    if (!card.rooted || card.rootLengthM <= 0) continue;
    blendCard(curveOf(card.group), card.rootLengthM, points, card.points, delta);
  }
  for (const cloth of groom.cloths) {
    if (cloth.rootLengthM <= 0) continue;
    const curve = curveOf(cloth.group);
    for (let i = 0; i < cloth.rootDistanceM.length; ++i)
      delta[cloth.points.begin + i] = blendAt(curve, cloth.rootDistanceM[i] / cloth.rootLengthM);
  }
  return delta;
}

/** The same for every point of the groom's far cards, along the middle of each. */
export function farCardBlend(groom: Groom): Float32Array {
  const { points, cards } = groom.farCards;
  const delta = new Float32Array(points.length / 3).fill(1);
  for (const card of cards) {
    if (!card.rooted || card.rootLengthM <= 0) continue;
    blendCard(curveOfGroup(groom, card.group), card.rootLengthM, points, card.points, delta);
  }
  return delta;
}

function curveOfGroup(groom: Groom, group: number): ArrayLike<number> {
  return groom.rootBlends[group] ?? [];
}

/** Along the middle of a card: both points of a pair have the same delta. */
function blendCard(
  curve: ArrayLike<number>,
  rootLengthM: number,
  points: Float32Array,
  { begin, end }: PointRange,
  delta: Float32Array,
): void {
  const pairs = (end - begin) >> 1;
  const middle = new Float32Array(3 * pairs);
  for (let i = 0; i < middle.length; ++i) {
    const left = 3 * begin + 6 * Math.floor(i / 3) + (i % 3);
    middle[i] = 0.5 * (points[left] + points[left + 3]);
  }
  const middleDelta = new Float32Array(pairs);
  blendLine(curve, rootLengthM, middle, 0, pairs, middleDelta);
  for (let i = 0; i < end - begin; ++i) delta[begin + i] = middleDelta[i >> 1];
}

/** Along a line of points from its root. */
function blendLine(
  curve: ArrayLike<number>,
  rootLengthM: number,
  points: Float32Array,
  begin: number,
  end: number,
  delta: Float32Array,
): void {
  let lambda = 0;
  for (let p = begin; p < end; ++p) {
    if (p > begin) {
      const at = 3 * p;
      const x = points[at] - points[at - 3];
      const y = points[at + 1] - points[at - 2];
      const z = points[at + 2] - points[at - 1];
      lambda += Math.sqrt(x * x + y * y + z * z);
    }
    delta[p] = blendAt(curve, lambda / rootLengthM);
  }
}
