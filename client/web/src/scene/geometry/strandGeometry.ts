import { kPieceM, kPiecesMax, kPlacedMax, kPointRow, kRunMax, kSagM, kTolerancesM } from "../../generated/constants";
import { HairnetError } from "../../hair/hairnetError";
import { eachClumpCopy, drawnStrandCount } from "./clumpStrands";
import type { GeometrySource } from "./geometrySource";
import type { StrandGeometry } from "./groomGeometry";
import { growingBytes, growingFloats, growingIndices } from "./growing";
import { toByte } from "./meshBuilder";

/** One drawn strand; each array has one number a point. */
interface Line {
  count: number;
  x: Float32Array; // 3 a point
  delta: Float32Array;
  fraction: Float32Array;
  own: Uint8Array; // 1: a point of the groom; 0: between two of them
}

export function makeStrands(source: GeometrySource): StrandGeometry {
  const { groom } = source;
  const drawn = drawnStrands(source);
  const order = shuffled(drawn.length);
  const points = new PointBuilder(source);
  const pointEnd = new Uint32Array(drawn.length + 1);
  const lists = kTolerancesM.map((toleranceM) => ({
    toleranceM,
    triangles: growingIndices(),
    end: new Uint32Array(drawn.length + 1),
  }));
  for (let n = 0; n < order.length; ++n) {
    const { points: own, strand } = drawn[order[n]];
    const rough = lineOf(source, own, groom.strands.begin[strand]);
    if (rough) {
      const line = smoothed(rough);
      const first = 2 * points.count;
      points.add(line, n);
      for (const list of lists) {
        const kept = keptPoints(line, list.toleranceM);
        let before = first;
        for (let i = 1; i < line.count; ++i) {
          if (!kept[i]) continue;
          const here = first + 2 * i;
          list.triangles.push(before, before + 1, here, here, before + 1, here + 1);
          before = here;
        }
      }
    }
    pointEnd[n + 1] = points.count;
    for (const list of lists) list.end[n + 1] = list.triangles.length;
  }
  return { ...points.take(), pointEnd, lists: lists.map((list) => ({ ...list, triangles: list.triangles.take() })) };
}

/** The points of strands, and two vertices for each. */
class PointBuilder {
  count = 0;
  readonly #rest = growingFloats();
  readonly #arc = growingFloats();
  readonly #sides = growingBytes();
  readonly #ends = growingBytes();
  readonly #strand = growingFloats();
  readonly #left = new Float32Array(6);

  constructor(private readonly source: GeometrySource) {}

  /** `strand`: its place in the order of drawing. */
  add(line: Line, strand: number): void {
    const { x } = line;
    const left = this.#left;
    let arcM = 0;
    for (let i = 0; i < line.count; ++i) {
      const at = 3 * i;
      if (i > 0) arcM += distance(x, at - 3, at);
      this.#rest.push(x[at], x[at + 1], x[at + 2], line.delta[i]);
      this.#arc.push(arcM, line.count <= kPlacedMax ? i : 0);
      this.source.occlusion.at(x[at], x[at + 1], x[at + 2], left);
      for (let side = 0; side < 2; ++side) {
        this.#sides.push(toByte(left[0]), toByte(left[1]), toByte(left[2]), toByte(left[3]));
        this.#ends.push(toByte(left[4]), toByte(left[5]), toByte(line.fraction[i]), 0);
        this.#strand.push(strand);
      }
    }
    this.count += line.count;
  }

  take() {
    const padding = (kPointRow - (this.count % kPointRow)) % kPointRow;
    this.#rest.push(...new Array<number>(4 * padding).fill(0));
    this.#arc.push(...new Array<number>(2 * padding).fill(0));
    return {
      rest: this.#rest.take(),
      arc: this.#arc.take(),
      sides: this.#sides.take(),
      ends: this.#ends.take(),
      strand: this.#strand.take(),
    };
  }
}

/** The groom's own strands, then the copies of clumps. The points of a copy have the values of its strand's points. */
function drawnStrands({ groom }: GeometrySource): { points: Float32Array; strand: number }[] {
  const drawn: { points: Float32Array; strand: number }[] = [];
  for (let s = 0; s < groom.strands.count; ++s)
    drawn.push({
      points: groom.points.subarray(3 * groom.strands.begin[s], 3 * groom.strands.begin[s + 1]),
      strand: s,
    });
  eachClumpCopy(groom, (points, strand) => drawn.push({ points, strand }));
  if (drawn.length !== drawnStrandCount(groom)) throw new HairnetError("invalid", "clumps' copies do not add up");
  return drawn;
}

/** Fisher and Yates with core's Random(1) (core/random.hpp), so that both renderers draw strands in one order. */
function shuffled(count: number): Uint32Array {
  const order = Uint32Array.from({ length: count }, (_, i) => i);
  const step = 0x9e3779b97f4a7c15n;
  let state = step ^ mixBits(step);
  for (let i = count; i > 1; --i) {
    state = BigInt.asUintN(64, state + step);
    const other = Number(mixBits(state) % BigInt(i));
    [order[i - 1], order[other]] = [order[other], order[i - 1]];
  }
  return order;
}

function mixBits(bits: bigint): bigint {
  let z = BigInt.asUintN(64, (bits ^ (bits >> 30n)) * 0xbf58476d1ce4e5b9n);
  z = BigInt.asUintN(64, (z ^ (z >> 27n)) * 0x94d049bb133111ebn);
  return z ^ (z >> 31n);
}

/** Returns null when there is nothing to draw. `first`: the first of the groom's points that belong to the line. */
function lineOf({ blend }: GeometrySource, points: Float32Array, first: number): Line | null {
  const count = points.length / 3;
  if (count < 2) return null;
  const fraction = new Float32Array(count);
  for (let i = 1; i < count; ++i) fraction[i] = fraction[i - 1] + distance(points, 3 * i - 3, 3 * i);
  const length = fraction[count - 1];
  if (!(length > 0)) return null;
  for (let i = 0; i < count; ++i) fraction[i] /= length;
  return {
    count,
    x: points,
    delta: blend.subarray(first, first + count),
    fraction,
    own: new Uint8Array(count).fill(1),
  };
}

function distance(points: Float32Array, a: number, b: number): number {
  return lengthOf(points[a] - points[b], points[a + 1] - points[b + 1], points[a + 2] - points[b + 2]);
}

/** Much faster than Math.hypot. */
function lengthOf(x: number, y: number, z: number): number {
  return Math.sqrt(x * x + y * y + z * z);
}

/** Replaces the corners of a polyline by a curve (Catmull-Rom) through the same points. */
function smoothed(line: Line): Line {
  const most = (line.count - 1) * kPiecesMax + 1;
  const smooth: Line = {
    count: 0,
    x: new Float32Array(3 * most),
    delta: new Float32Array(most),
    fraction: new Float32Array(most),
    own: new Uint8Array(most),
  };
  const at = [0, 0, 0];
  const spline = (i: number, t: number) => {
    for (let axis = 0; axis < 3; ++axis) {
      const b = line.x[3 * i + axis];
      const c = line.x[3 * i + 3 + axis];
      const a = i > 0 ? line.x[3 * i - 3 + axis] : 2 * b - c;
      const d = i + 2 < line.count ? line.x[3 * i + 6 + axis] : 2 * c - b;
      at[axis] = 0.5 * (2 * b + t * (c - a) + t * t * (2 * a - 5 * b + 4 * c - d) + t * t * t * (3 * (b - c) + d - a));
    }
  };
  const add = (i: number, t: number) => {
    const n = smooth.count++;
    const next = Math.min(i + 1, line.count - 1);
    for (let axis = 0; axis < 3; ++axis) smooth.x[3 * n + axis] = at[axis];
    smooth.delta[n] = mix(line.delta[i], line.delta[next], t);
    smooth.own[n] = t > 0 ? 0 : 1;
    smooth.fraction[n] = mix(line.fraction[i], line.fraction[next], t);
  };
  for (let i = 0; i + 1 < line.count; ++i) {
    spline(i, 0.5);
    const p = 3 * i;
    const sag = lengthOf(
      at[0] - 0.5 * (line.x[p] + line.x[p + 3]),
      at[1] - 0.5 * (line.x[p + 1] + line.x[p + 4]),
      at[2] - 0.5 * (line.x[p + 2] + line.x[p + 5]),
    );
    const wanted = Math.max(Math.sqrt(sag / kSagM), distance(line.x, p, p + 3) / kPieceM);
    const pieces = Math.min(Math.max(Math.ceil(wanted), 1), kPiecesMax);
    for (let piece = 0; piece < pieces; ++piece) {
      const t = piece / pieces;
      spline(i, t);
      if (piece === 0) for (let axis = 0; axis < 3; ++axis) at[axis] = line.x[3 * i + axis];
      add(i, t);
    }
  }
  for (let axis = 0; axis < 3; ++axis) at[axis] = line.x[3 * (line.count - 1) + axis];
  add(line.count - 1, 0);
  return smooth;
}

function mix(a: number, b: number, t: number): number {
  return a + t * (b - a);
}

function keptPoints(line: Line, toleranceM: number): Uint8Array {
  const last = line.count - 1;
  const kept = new Uint8Array(line.count);
  if (toleranceM === 0) return kept.fill(1);
  kept[0] = kept[last] = 1;
  // Roots and tips stay, since one sees where hair begins and ends. A straight line keeps some points for the lattice to bend.
  if (toleranceM < 2e-3) for (let i = 0; i < line.count; i += 4) kept[i] = 1;
  if (toleranceM < 5e-4) for (let i = 0; i < line.count; ++i) kept[i] |= line.own[i];
  kept[line.count >> 1] = kept[line.count >> 2] = 1;
  for (let i = 0; i < line.count; i += kRunMax) kept[i] = 1;
  // Each piece between two kept points is simplified alone: the drawn line bends at its ends.
  for (let first = 0, i = 1; i <= last; ++i) {
    if (!kept[i]) continue;
    simplify(line, first, i, toleranceM, kept);
    first = i;
  }
  return kept;
}

/** Marks the points between first and last that must stay, so that none is further than the tolerance from the line (Douglas-Peucker). */
function simplify(line: Line, first: number, last: number, toleranceM: number, kept: Uint8Array): void {
  const open = [first, last];
  while (open.length > 0) {
    const end = open.pop()!;
    const begin = open.pop()!;
    const at = furthest(line, begin, end, toleranceM);
    if (at === begin) continue;
    kept[at] = 1;
    open.push(begin, at, at, end);
  }
}

/** The point between first and last that is furthest from their line; `first` when none is further than the tolerance. */
function furthest(line: Line, first: number, last: number, toleranceM: number): number {
  const { x } = line;
  const f = 3 * first;
  const ax = x[3 * last] - x[f];
  const ay = x[3 * last + 1] - x[f + 1];
  const az = x[3 * last + 2] - x[f + 2];
  const length2 = Math.max(ax * ax + ay * ay + az * az, 1e-20);
  let worst = toleranceM * toleranceM;
  let at = first;
  for (let i = first + 1; i < last; ++i) {
    const dx = x[3 * i] - x[f];
    const dy = x[3 * i + 1] - x[f + 1];
    const dz = x[3 * i + 2] - x[f + 2];
    const along = Math.min(Math.max((dx * ax + dy * ay + dz * az) / length2, 0), 1);
    const distance2 = (dx - along * ax) ** 2 + (dy - along * ay) ** 2 + (dz - along * az) ** 2;
    if (distance2 > worst) {
      worst = distance2;
      at = i;
    }
  }
  return at;
}
