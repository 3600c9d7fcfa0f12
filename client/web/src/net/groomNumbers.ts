import type * as g from "../hair/groom";
import { HairnetError } from "../hair/hairnetError";
import { kBoneCount } from "../hair/pose";

// The numbers of a groom file of version 3, as schema/wire/groom_numbers.cpp writes them.
const kPlanes = 3;
const kStepM = 5e-5;
const kBoneWeightMax = 4095;
const kTaps = 4;
const kWeightUnit = 4096;

/** The points [begin, end) of one strand, thread, card or cloth. Those of a card come in pairs: stride 2. */
export interface PointRun {
  readonly begin: number;
  readonly end: number;
  readonly stride: number;
}

function invalid(why: string): HairnetError {
  return new HairnetError("invalid", why);
}

/** The integers of byte planes, each with its sign in the lowest bit. */
function decodePlanes(planes: Uint8Array): Int32Array {
  const count = Math.floor(planes.length / kPlanes);
  const integers = new Int32Array(count);
  for (let i = 0; i < count; ++i) {
    const folded = planes[i] | (planes[count + i] << 8) | (planes[2 * count + i] << 16);
    integers[i] = (folded >>> 1) ^ -(folded & 1);
  }
  return integers;
}

/** The points of all strands, threads, cards and cloths, or of far cards; `runs` cover them in order. */
export function decodePoints(weights: Int16Array, planes: Uint8Array, runs: readonly PointRun[]): Float32Array {
  const count = runs.length > 0 ? runs[runs.length - 1].end : 0;
  if (planes.length !== 3 * kPlanes * count)
    throw invalid(`${Math.floor(planes.length / 3 / kPlanes)} points, not ${count} as counted`);
  const remainders = decodePlanes(planes);
  const q = new Int32Array(3 * count);
  let next = 0;
  let row = runs.filter((run) => run.begin < run.end);
  for (let number = 0; row.length > 0; ++number) {
    const first = kTaps * (number - 2);
    const taps = number >= 2 && first + kTaps <= weights.length ? weights.subarray(first, first + kTaps) : null;
    for (const run of row) {
      const step = 3 * run.stride;
      const begin = 3 * run.begin + number * step;
      const end = Math.min(begin + step, 3 * run.end);
      for (let i = begin; i < end; ++i) {
        const predicted = number === 0 ? 0 : q[i - step] + (taps ? predictedStep(q, number, i, step, taps) : 0);
        q[i] = ((predicted + remainders[next++]) << 8) >> 8; // the lowest 24 bits, signed
      }
    }
    row = row.filter((run) => run.begin + (number + 1) * run.stride < run.end);
  }
  const points = new Float32Array(3 * count);
  for (let i = 0; i < points.length; ++i) points[i] = q[i] * kStepM;
  return points;
}

/** From the point before coordinate i to i's own, by the steps before that. All sums are exact: below 2^53. */
function predictedStep(q: Int32Array, number: number, i: number, step: number, taps: Int16Array): number {
  let sum = kWeightUnit / 2;
  for (let t = 0, at = i - step; t < kTaps && t + 2 <= number; ++t, at -= step) sum += taps[t] * (q[at] - q[at - step]);
  return Math.floor(sum / kWeightUnit);
}

export function decodeBoneWeights(planes: Uint8Array): Float32Array {
  if (planes.length % (kPlanes * kBoneCount) !== 0) throw invalid("body: bone weights are not 5 numbers each");
  return Float32Array.from(decodePlanes(planes), (weight) => weight / kBoneWeightMax);
}

export function decodeTriangles(planes: Uint8Array): Uint32Array {
  if (planes.length % (3 * kPlanes) !== 0) throw invalid("body: triangles are not 3 numbers each");
  let before = 0;
  return Uint32Array.from(decodePlanes(planes), (step) => (before += step));
}

/** The offsets of strands that have that many points each; one more than strands. */
export function strandOffsets(counts: Uint32Array): Uint32Array {
  const begin = new Uint32Array(counts.length + 1);
  let next = 0;
  counts.forEach((count, i) => {
    next += count;
    if (next > 0xffffffff) throw invalid("more points than can be counted");
    begin[i + 1] = next;
  });
  return begin;
}

export function pointRuns(begin: Uint32Array, groom: Pick<g.Groom, "threads" | "cards" | "cloths">): PointRun[] {
  const runs: PointRun[] = [];
  for (let s = 0; s + 1 < begin.length; ++s) runs.push({ begin: begin[s], end: begin[s + 1], stride: 1 });
  for (const { points } of groom.threads) runs.push({ ...points, stride: 1 });
  for (const { points } of groom.cards) runs.push({ ...points, stride: 2 });
  for (const { points } of groom.cloths) runs.push({ ...points, stride: 1 });
  return runs;
}
