import type { FarCards, Groom } from "./groom";

/** The direction of the hair at each point of a groom at rest: derivatives by the arc length s. */
export interface RestTangents {
  /** dx / ds, of unit length, head space; 3 a point */
  readonly direction: Float32Array;
  /** d delta / ds, 1/m */
  readonly blendSlope: Float32Array;
}

/**
 * Computes them for all points of the groom: along strands, threads and the middle of cards, as differences of a
 * point's neighbours. Zero for points of cloths and of lines without length. `blend` is delta of each point
 * (`rootBlend`).
 */
export function restTangents(groom: Groom, blend: Float32Array): RestTangents {
  const { points, strands } = groom;
  const rest = { direction: new Float32Array(points.length), blendSlope: new Float32Array(blend.length) };
  for (let s = 0; s < strands.count; ++s) addLine(points, blend, strands.begin[s], strands.begin[s + 1], 1, rest);
  for (const thread of groom.threads) addLine(points, blend, thread.points.begin, thread.points.end, 1, rest);
  for (const card of groom.cards) addLine(points, blend, card.points.begin, card.points.end, 2, rest);
  return rest;
}

/** The same of far cards' points, along either edge. `blend` is that of `farCardBlend`. */
export function farCardTangents(far: FarCards, blend: Float32Array): RestTangents {
  const rest = { direction: new Float32Array(far.points.length), blendSlope: new Float32Array(blend.length) };
  for (const card of far.cards) addLine(far.points, blend, card.points.begin, card.points.end, 2, rest);
  return rest;
}

/**
 * Unit vectors, 3 numbers a point, the same for both points of a pair: across (left to right) x along, away from the
 * head.
 */
export function farCardNormals(far: FarCards, rest: RestTangents): Float32Array {
  const { points } = far;
  const { direction } = rest;
  const normals = new Float32Array(points.length);
  for (const card of far.cards) {
    for (let p = 3 * card.points.begin; p + 5 < 3 * card.points.end; p += 6) {
      // One normal for each pair, so that a card is flat across.
      const [ax, ay, az] = [points[p + 3] - points[p], points[p + 4] - points[p + 1], points[p + 5] - points[p + 2]];
      const [bx, by, bz] = [
        direction[p] + direction[p + 3],
        direction[p + 1] + direction[p + 4],
        direction[p + 2] + direction[p + 5],
      ];
      const x = ay * bz - az * by;
      const y = az * bx - ax * bz;
      const z = ax * by - ay * bx;
      const length = Math.hypot(x, y, z);
      const normal = length > 0 ? [x / length, y / length, z / length] : [0, 0, 1];
      normals.set(normal, p);
      normals.set(normal, p + 3);
    }
  }
  return normals;
}

/** The points of a line are `stride` apart: a card has two edges. */
function addLine(
  points: Float32Array,
  blend: Float32Array,
  begin: number,
  end: number,
  stride: number,
  rest: RestTangents,
): void {
  if (end - begin < stride) return;
  const last = end - stride;
  for (let p = begin; p < end; ++p) {
    const before = p < begin + stride ? p : p - stride;
    const after = p >= last ? p : p + stride;
    const chord = distance(points, before, after);
    if (chord === 0) continue;
    const arc = distance(points, p, after) + distance(points, before, p);
    for (let axis = 0; axis < 3; ++axis)
      rest.direction[3 * p + axis] = (points[3 * after + axis] - points[3 * before + axis]) / chord;
    rest.blendSlope[p] = (blend[after] - blend[before]) / arc;
  }
}

function distance(points: Float32Array, a: number, b: number): number {
  const x = points[3 * a] - points[3 * b];
  const y = points[3 * a + 1] - points[3 * b + 1];
  const z = points[3 * a + 2] - points[3 * b + 2];
  return Math.sqrt(x * x + y * y + z * z);
}
