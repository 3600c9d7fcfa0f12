import { eachClusterCopy, drawnStrandCount } from "./clusterStrands";
import type { GeometrySource, StrandList } from "./groomGeometry";
import { growingIndices } from "./growing";
import { MeshBuilder, type MeshArrays } from "./meshBuilder";

const kSagM = 5e-4; // of a smooth line over its pieces, at most, as far as kPiecesMost allow
const kPiecesMost = 2;
const kRunMost = 256; // points between two that stay: what one looks through to find the furthest
const kTolerancesM = [0, 8e-4, 4e-3];

/** One drawn strand, a number a point; x and tangent in three arrays each. */
interface Line {
  count: number;
  x: Float32Array; // 3 a point
  tangent: Float32Array; // 3 a point
  delta: Float32Array;
  deltaSlope: Float32Array;
  fraction: Float32Array;
}

export function makeStrands(source: GeometrySource): { mesh: MeshArrays; lists: StrandList[] } {
  const { groom } = source;
  const drawn = drawnStrands(source);
  const order = shuffled(drawn.length);
  const builder = new MeshBuilder(1);
  const lists = kTolerancesM.map((toleranceM) => ({
    toleranceM,
    triangles: growingIndices(),
    end: new Uint32Array(drawn.length + 1),
  }));
  const left = new Float32Array(6);
  for (let n = 0; n < order.length; ++n) {
    const { points, strand } = drawn[order[n]];
    const rough = lineOf(source, points, groom.strands.begin[strand]);
    if (rough) {
      const line = smoothed(rough);
      const first = builder.vertexCount;
      for (let i = 0; i < line.count; ++i) {
        const at = 3 * i;
        source.light.at(line.x[at], line.x[at + 1], line.x[at + 2], left);
        for (let side = 0; side < 2; ++side) {
          builder.add(
            line.x[at],
            line.x[at + 1],
            line.x[at + 2],
            line.delta[i],
            line.tangent[at],
            line.tangent[at + 1],
            line.tangent[at + 2],
            line.deltaSlope[i],
            left,
            line.fraction[i],
            0,
          );
          builder.addExtra(n);
        }
      }
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
    for (const list of lists) list.end[n + 1] = list.triangles.length;
  }
  return { mesh: builder.take(), lists: lists.map((list) => ({ ...list, triangles: list.triangles.take() })) };
}

/** The groom's own strands, then clusters' copies, whose points have what their strand's have. */
function drawnStrands({ groom }: GeometrySource): { points: Float32Array; strand: number }[] {
  const drawn: { points: Float32Array; strand: number }[] = [];
  for (let s = 0; s < groom.strands.count; ++s)
    drawn.push({ points: groom.points.subarray(3 * groom.strands.begin[s], 3 * groom.strands.begin[s + 1]), strand: s });
  eachClusterCopy(groom, (points, strand) => drawn.push({ points, strand }));
  if (drawn.length !== drawnStrandCount(groom)) throw new Error("clusters' copies do not add up");
  return drawn;
}

/** Fisher and Yates, the same each time. */
function shuffled(count: number): Uint32Array {
  const order = Uint32Array.from({ length: count }, (_, i) => i);
  let state = 1;
  for (let i = count; i > 1; --i) {
    state = (Math.imul(state, 747796405) + 2891336453) >>> 0;
    const scrambled = Math.imul((state >>> ((state >>> 28) + 4)) ^ state, 277803737) >>> 0;
    const j = ((scrambled >>> 22) ^ scrambled) >>> 0;
    const other = j % i;
    const kept = order[i - 1];
    order[i - 1] = order[other];
    order[other] = kept;
  }
  return order;
}

/** Null when there is nothing to draw. `first`: of the groom's points that those of the line go with. */
function lineOf({ rest, blend }: GeometrySource, points: Float32Array, first: number): Line | null {
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
    tangent: rest.direction.subarray(3 * first, 3 * (first + count)),
    delta: blend.subarray(first, first + count),
    deltaSlope: rest.blendSlope.subarray(first, first + count),
    fraction,
  };
}

function distance(points: Float32Array, a: number, b: number): number {
  return lengthOf(points[a] - points[b], points[a + 1] - points[b + 1], points[a + 2] - points[b + 2]);
}

/** Much faster than Math.hypot. */
function lengthOf(x: number, y: number, z: number): number {
  return Math.sqrt(x * x + y * y + z * z);
}

/** Corners of a polyline become a curve (Catmull-Rom) through the same points. */
function smoothed(line: Line): Line {
  const most = (line.count - 1) * kPiecesMost + 1;
  const smooth: Line = {
    count: 0,
    x: new Float32Array(3 * most),
    tangent: new Float32Array(3 * most),
    delta: new Float32Array(most),
    deltaSlope: new Float32Array(most),
    fraction: new Float32Array(most),
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
    const tx = mix(line.tangent[3 * i], line.tangent[3 * next], t);
    const ty = mix(line.tangent[3 * i + 1], line.tangent[3 * next + 1], t);
    const tz = mix(line.tangent[3 * i + 2], line.tangent[3 * next + 2], t);
    const length = lengthOf(tx, ty, tz);
    const scale = t > 0 && length > 1e-6 ? 1 / length : 1;
    for (let axis = 0; axis < 3; ++axis) smooth.x[3 * n + axis] = at[axis];
    smooth.tangent[3 * n] = tx * scale;
    smooth.tangent[3 * n + 1] = ty * scale;
    smooth.tangent[3 * n + 2] = tz * scale;
    smooth.delta[n] = mix(line.delta[i], line.delta[next], t);
    smooth.deltaSlope[n] = mix(line.deltaSlope[i], line.deltaSlope[next], t);
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
    const pieces = Math.min(Math.max(Math.ceil(Math.sqrt(sag / kSagM)), 1), kPiecesMost);
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
  // Roots and tips are where hair is seen to begin and end: a straight line keeps some points for the lattice to bend.
  if (toleranceM < 2e-3) for (let i = 0; i < line.count; i += 4) kept[i] = 1;
  kept[line.count >> 1] = kept[line.count >> 2] = 1;
  for (let i = 0; i < line.count; i += kRunMost) kept[i] = 1;
  // Between each two that stay, as a piece of its own: its ends are where the drawn line bends.
  for (let first = 0, i = 1; i <= last; ++i) {
    if (!kept[i]) continue;
    simplify(line, first, i, toleranceM, kept);
    first = i;
  }
  return kept;
}

/** Marks what of (first, last) must stay so that nothing is further than the tolerance from the line (Douglas, Peucker). */
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

/** Of the points between two the one furthest from their line; `first` when none is further than the tolerance. */
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
