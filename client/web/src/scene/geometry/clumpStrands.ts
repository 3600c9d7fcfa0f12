import type { Groom } from "../../hair/groom";

const kGoldenAngle = Math.PI * (3 - 2.2360679775);

/** The number of drawn strands: the groom's own and the copies of its clumps. */
export function drawnStrandCount(groom: Groom): number {
  return groom.clumps.reduce((count, clump) => count + clump.copyCount, groom.strands.count);
}

/** Calls `take` with the points (3 each) of every copy of every clump, in order, and the strand that it follows. */
export function eachClumpCopy(groom: Groom, take: (points: Float32Array, strand: number) => void): void {
  for (const clump of groom.clumps) {
    const begin = groom.strands.begin[clump.strand];
    const points = groom.points.subarray(3 * begin, 3 * groom.strands.begin[clump.strand + 1]);
    for (let c = 0; c < clump.copyCount; ++c) {
      // Copies fill the disc evenly, like the seeds of a sunflower; each strand has its own rotation.
      const ring = Math.min(Math.sqrt((c + 0.7) / clump.copyCount), 1);
      const angle = (kGoldenAngle * (c + 7 * (clump.strand % 1024))) % (2 * Math.PI);
      take(follow(points, ring, angle, clump.radiusM, clump.tipRadiusM), clump.strand);
    }
  }
}

/** Places the copy at an offset in a frame that moves along the strand without twist (core/ffd/clump_strands.cpp). */
function follow(points: Float32Array, ring: number, angle: number, radiusM: number, tipRadiusM: number): Float32Array {
  const out = new Float32Array(points.length);
  const last = points.length / 3 - 1;
  let side = [0, 0, 1];
  for (let i = 0; i <= last; ++i) {
    const before = 3 * Math.max(i - 1, 0);
    const after = 3 * Math.min(i + 1, last);
    const chord = [0, 1, 2].map((axis) => points[after + axis] - points[before + axis]);
    const length = Math.hypot(...chord);
    const direction = length > 1e-8 ? chord.map((x) => x / length) : [0, -1, 0];
    side = across(direction, side);
    const other = cross(direction, side);
    const s = last > 0 ? i / last : 0;
    const offset = ring * Math.min(1, 0.4 + 4.8 * s) * (radiusM + s * (tipRadiusM - radiusM));
    for (let axis = 0; axis < 3; ++axis)
      out[3 * i + axis] =
        points[3 * i + axis] + offset * (Math.cos(angle) * side[axis] + Math.sin(angle) * other[axis]);
  }
  return out;
}

function across(direction: number[], wanted: number[]): number[] {
  const along = wanted[0] * direction[0] + wanted[1] * direction[1] + wanted[2] * direction[2];
  let flat = wanted.map((x, axis) => x - along * direction[axis]);
  if (Math.hypot(...flat) <= 1e-4) flat = orthogonal(direction);
  const length = Math.hypot(...flat);
  return flat.map((x) => x / length);
}

/** A unit vector across `direction`, the same as Eigen's unitOrthogonal chooses. */
function orthogonal([x, y, z]: number[]): number[] {
  return Math.hypot(x, y) > 1e-5 * Math.abs(z) ? [-y, x, 0] : [0, -z, y];
}

function cross(a: number[], b: number[]): number[] {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}
