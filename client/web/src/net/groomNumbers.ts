import type * as g from "../hair/groom";
import { HairnetError } from "../hair/hairnetError";
import { kBoneCount } from "../hair/pose";

// The numbers of a groom file of version 3, as schema/wire/groom_numbers.cpp writes them.
const kPlanes = 3;
const kStepM = 5e-5;
const kBoneWeightMax = 4095;
const kTaps = 4;
const kWeightsPerRow = kTaps + 1;
const kWeightUnit = 4096;

/** The points [begin, end) of one strand, thread, card or cloth. Those of a card come in pairs: stride 2. */
export interface PointRun extends g.PointRange {
  readonly stride: number;
}

/** Of points: what remains of their coordinates, and what predicts the rest. An absent vector is an empty one. */
export interface EncodedPoints {
  readonly weights: Int16Array | null;
  readonly references: Uint8Array | null;
  readonly planes: Uint8Array | null;
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
export function decodePoints(encoded: EncodedPoints, runs: readonly PointRun[]): Float32Array {
  const weights = encoded.weights ?? new Int16Array(0);
  const planes = encoded.planes ?? kNoPlanes;
  const count = runs.length > 0 ? runs[runs.length - 1].end : 0;
  if (planes.length !== 3 * kPlanes * count)
    throw invalid(`${Math.floor(planes.length / 3 / kPlanes)} points, not ${count} as counted`);
  const references = decodeReferences(encoded.references ?? kNoPlanes, runs);
  const remainders = decodePlanes(planes);
  const q = new Int32Array(3 * count);
  const errors = new Int32Array(3 * count);
  let next = 0;
  let row = runs.map(({ begin, end, stride }, r) => {
    const reference = references[r];
    return { begin, end, stride, ahead: begin - (reference?.begin ?? begin), referenceEnd: reference?.end ?? 0 };
  });
  row = row.filter((run) => run.begin < run.end);
  for (let number = 0; row.length > 0; ++number) {
    const first = kWeightsPerRow * number;
    const fitted = weights.subarray(first, first + kWeightsPerRow);
    const known = fitted.length === kWeightsPerRow;
    for (const run of row) {
      const step = 3 * run.stride;
      const begin = 3 * run.begin + number * step;
      const end = Math.min(begin + step, 3 * run.end);
      const ahead = 3 * run.ahead;
      const referenceEnd = 3 * run.referenceEnd;
      for (let i = begin; i < end; ++i) {
        let error = remainders[next++];
        let predicted = number === 0 ? 0 : q[i - step];
        if (known) {
          if (i - ahead < referenceEnd) error += scaled(fitted[kTaps] * errors[i - ahead]);
          predicted += predictedStep(q, number, i, step, fitted);
        }
        errors[i] = wrapped(error);
        q[i] = wrapped(predicted + errors[i]);
      }
    }
    row = row.filter((run) => run.begin + (number + 1) * run.stride < run.end);
  }
  const points = new Float32Array(3 * count);
  for (let i = 0; i < points.length; ++i) points[i] = q[i] * kStepM;
  return points;
}
const kNoPlanes = new Uint8Array(0);

/** The earlier run that each run resembles; undefined: none. */
function decodeReferences(planes: Uint8Array, runs: readonly PointRun[]): (PointRun | undefined)[] {
  if (planes.length === 0) return [];
  if (planes.length !== kPlanes * runs.length)
    throw invalid(`${Math.floor(planes.length / kPlanes)} references, not ${runs.length} as counted`);
  return Array.from(decodePlanes(planes), (back, r) => {
    if (back < 0 || back > r) throw invalid("a reference to points that do not come before");
    if (runs[r - back].stride !== runs[r].stride) throw invalid("a reference to points of another kind");
    return back > 0 ? runs[r - back] : undefined;
  });
}

/** The lowest 24 bits, signed. */
function wrapped(value: number): number {
  return (value << 8) >> 8;
}

/** A weighted sum, rounded to the nearest. All sums are exact: below 2^53. */
function scaled(sum: number): number {
  return Math.floor((sum + kWeightUnit / 2) / kWeightUnit);
}

/** From the point before coordinate i to i's own, by the steps before that. */
function predictedStep(q: Int32Array, number: number, i: number, step: number, weights: Int16Array): number {
  let sum = 0;
  for (let t = 0, at = i - step; t < kTaps && t + 2 <= number; ++t, at -= step)
    sum += weights[t] * (q[at] - q[at - step]);
  return scaled(sum);
}

export function decodeBoneWeights(planes: Uint8Array | null): Float32Array {
  if ((planes?.length ?? 0) % (kPlanes * kBoneCount) !== 0) throw invalid("body: bone weights are not 5 numbers each");
  return Float32Array.from(decodePlanes(planes ?? kNoPlanes), (weight) => weight / kBoneWeightMax);
}

export function decodeIndices(planes: Uint8Array | null): Uint32Array {
  if ((planes?.length ?? 0) % kPlanes !== 0) throw invalid("indices are not whole");
  let before = 0;
  return Uint32Array.from(decodePlanes(planes ?? kNoPlanes), (step) => (before += step));
}

export function decodeTriangles(planes: Uint8Array | null): Uint32Array {
  const triangles = decodeIndices(planes);
  if (triangles.length % 3 !== 0) throw invalid("body: triangles are not 3 numbers each");
  return triangles;
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
