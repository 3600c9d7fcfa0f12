import type { Groom } from "./groom";

/** How hair goes on at each point of a groom, by the arc length s at rest. */
export interface RestTangents {
  /** dx / ds, of unit length, head space; 3 a point */
  readonly direction: Float32Array;
  /** d delta / ds, 1/m */
  readonly blendSlope: Float32Array;
}

/**
 * Of all points of the groom: along strands, threads and the middle of strips, differences between a point's neighbours.
 * Zero where no line leads: on cloths, and on lines of no length. `blend` is delta of each point (`rootBlend`).
 */
export function restTangents(groom: Groom, blend: Float32Array): RestTangents {
  const rest = { direction: new Float32Array(groom.points.length), blendSlope: new Float32Array(blend.length) };
  const { strands } = groom;
  for (let s = 0; s < strands.count; ++s) addLine(groom, blend, strands.begin[s], strands.begin[s + 1], 1, rest);
  for (const thread of groom.threads) addLine(groom, blend, thread.points.begin, thread.points.end, 1, rest);
  for (const strip of groom.strips) addLine(groom, blend, strip.points.begin, strip.points.end, 2, rest);
  return rest;
}

/** A line's next point is `stride` points on: a strip has two edges. */
function addLine(
  groom: Groom,
  blend: Float32Array,
  begin: number,
  end: number,
  stride: number,
  rest: RestTangents,
): void {
  if (end - begin < stride) return;
  const { points } = groom;
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
