import { describe, expect, test } from "vitest";
import { buffersOf, makeGroomGeometry } from "../../src/scene/geometry/groomGeometry";
import { kPointRow } from "../../src/scene/geometry/strandGeometry";
import { toHalf } from "../../src/scene/geometry/half";
import { OcclusionGrid } from "../../src/scene/geometry/occlusionGrid";
import { Scalp } from "../../src/scene/geometry/scalp";
import { madeGroom } from "../support/madeGroom";

function fromHalf(half: number): number {
  const exponent = (half >> 10) & 31;
  const part = half & 1023;
  const size = exponent === 0 ? part * 2 ** -24 : (1 + part / 1024) * 2 ** (exponent - 15);
  return half & 0x8000 ? -size : size;
}

describe("a groom's geometry", () => {
  const groom = madeGroom(40, 12);
  const geometry = makeGroomGeometry(groom);
  const { strands } = geometry;

  test("has every point of every strand twice, left and right, with its root blend", () => {
    const points = strands.pointEnd[geometry.strandCount];
    expect(points).toBeGreaterThanOrEqual(groom.points.length / 3);
    expect(strands.strand).toHaveLength(2 * points);
    for (let p = 0; p < points; ++p) {
      expect(strands.strand[2 * p]).toBe(strands.strand[2 * p + 1]);
      expect(strands.rest[4 * p + 3]).toBeGreaterThanOrEqual(0);
      expect(strands.rest[4 * p + 3]).toBeLessThanOrEqual(1);
    }
    const drawn = new Set(Array.from({ length: points }, (_, p) => strands.rest.subarray(4 * p, 4 * p + 3).join()));
    for (let p = 0; p < groom.points.length; p += 3) expect(drawn).toContain(groom.points.subarray(p, p + 3).join());
  });

  test("measures every point from the root of its strand, and fills whole rows of points", () => {
    expect(strands.rest.length % (4 * kPointRow)).toBe(0);
    expect(strands.arc.length / 2).toBe(strands.rest.length / 4);
    for (let n = 0; n < geometry.strandCount; ++n) {
      let arc = 0;
      for (let p = strands.pointEnd[n]; p < strands.pointEnd[n + 1]; ++p) {
        const i = p - strands.pointEnd[n];
        if (i > 0) arc += Math.hypot(...[0, 1, 2].map((a) => strands.rest[4 * p + a] - strands.rest[4 * p - 4 + a]));
        expect(strands.arc[2 * p]).toBeCloseTo(arc, 6);
        expect(strands.arc[2 * p + 1]).toBe(i);
        expect(strands.strand[2 * p]).toBe(n);
      }
    }
  });

  test("draws a prefix of its list as so many whole strands, spread over the head", () => {
    const [all] = strands.lists;
    expect(all.end).toHaveLength(geometry.strandCount + 1);
    expect(all.end[geometry.strandCount]).toBe(all.triangles.length);
    const half = geometry.strandCount / 2;
    const drawn = new Set(Array.from(all.triangles.subarray(0, all.end[half]), (v) => strands.strand[v]));
    expect([...drawn].sort((a, b) => a - b)).toEqual(Array.from({ length: half }, (_, n) => n));
    let left = 0;
    for (const v of all.triangles.subarray(0, all.end[half])) if (strands.rest[4 * (v >> 1)] < 0) ++left;
    expect(left / all.end[half]).toBeGreaterThan(0.3);
    expect(left / all.end[half]).toBeLessThan(0.7);
  });

  test("keeps to the tolerance of each list and needs fewer points for a larger one", () => {
    const [all, ...coarser] = strands.lists;
    let before = all.triangles.length;
    for (const list of coarser) {
      expect(list.triangles.length).toBeLessThan(before);
      before = list.triangles.length;
      for (let t = 0; t < list.triangles.length; t += 6) {
        const from = list.triangles[t];
        const to = list.triangles[t + 2];
        for (let v = from + 2; v < to; v += 2) expect(distanceToSegment(strands.rest, v, from, to)).toBeLessThanOrEqual(list.toleranceM);
      }
    }
  });

  test("keeps to it on a strand of very many points, each further off than all before", () => {
    const count = 40_000;
    const long = madeGroom(1, count);
    for (let i = 0; i < count; ++i) long.points[3 * i] = ((i % 2 ? 0.05 : -0.05) * i) / count;
    const { strands } = makeGroomGeometry(long);
    for (const { triangles, toleranceM } of strands.lists)
      for (let t = 0; t < triangles.length; t += 6) {
        const [from, to] = [triangles[t], triangles[t + 2]];
        for (let v = from + 2; v < to; v += 2)
          if (distanceToSegment(strands.rest, v, from, to) > toleranceM) expect.fail(`point ${v} is further off than ${toleranceM}`);
      }
    expect(strands.lists[2].triangles.length).toBeLessThan(strands.lists[0].triangles.length);
  });

  test("names each buffer once for a worker to hand over", () => {
    const buffers = buffersOf(geometry);
    expect(new Set(buffers).size).toBe(buffers.length);
    expect(buffers).toContain(strands.rest.buffer);
  });

  test("adds the copies of clumps within their radius of the strand", () => {
    const clustered = makeGroomGeometry({
      ...groom,
      clumps: [{ strand: 3, copyCount: 5, radiusM: 0.004, tipRadiusM: 0.002 }],
    });
    expect(clustered.strandCount).toBe(45);
    const own = groom.points.subarray(3 * groom.strands.begin[3], 3 * groom.strands.begin[4]);
    const near = (v: number) => {
      for (let i = 0; i < own.length; i += 3)
        if (Math.hypot(...[0, 1, 2].map((a) => own[i + a] - clustered.strands.rest[4 * (v >> 1) + a])) <= 0.0045) return true;
      return false;
    };
    const strandsNear = new Set<number>();
    for (const v of clustered.strands.lists[0].triangles) if (near(v)) strandsNear.add(clustered.strands.strand[v]);
    expect(strandsNear.size).toBe(6);
  });
});

describe("the light field", () => {
  test("leaves light outside and takes it inside, from the side that hair and skull are on", () => {
    const light = new OcclusionGrid(madeGroom(2000, 12), 4e-3);
    const out = new Float32Array(6);
    expect([...light.at(0, 2, 0, out)]).toEqual([1, 1, 1, 1, 1, 1]);
    light.at(0.07, 0.05, 0, out);
    expect(out[0]).toBeGreaterThan(out[1]); // +x is outwards here, the skull lies at -x
    for (const left of out) expect(left).toBeGreaterThanOrEqual(0);
    for (const left of out) expect(left).toBeLessThanOrEqual(1.001);
  });

  test("of a groom that is the same on both sides is the same on both sides, but for its cells", () => {
    const light = new OcclusionGrid(madeGroom(400, 12, 0), 4e-3);
    const a = new Float32Array(6);
    const b = new Float32Array(6);
    const apart = [0, 0];
    let count = 0;
    for (let y = -0.1; y < 0.2; y += 0.01)
      for (let x = 0.02; x < 0.12; x += 0.01, ++count) {
        light.at(x, y, 0.01, a);
        light.at(-x, y, 0.01, b);
        apart[0] += a[0] - b[1];
        apart[1] += a[1] - b[0];
      }
    for (const sum of apart) expect(Math.abs(sum / count)).toBeLessThan(0.03);
  });

  test("is none where there is no hair", () => {
    const light = new OcclusionGrid(madeGroom(0, 12), 4e-3);
    expect([...light.at(0, 0.1, 0, new Float32Array(6))]).toEqual([1, 1, 1, 1, 1, 1]);
  });
});

describe("the scalp", () => {
  test("is where roots are and between them, and fades out beyond them", () => {
    const groom = madeGroom(400, 12, 0); // roots in a ring of 9 cm at 16 cm
    const scalp = new Scalp(groom);
    expect(scalp.at(0, 0.16, 0.09)).toBe(1);
    let before = 1;
    for (let out = 0.09; out < 0.12; out += 0.002) {
      expect(scalp.at(0, 0.16, out)).toBeLessThanOrEqual(before);
      before = scalp.at(0, 0.16, out);
    }
    expect(before).toBe(0);
    expect(scalp.at(0, 0, 0.09)).toBe(0);
  });

  test("is nowhere where nothing grows", () => {
    expect(new Scalp(madeGroom(0, 12)).at(0, 0.16, 0.09)).toBe(0);
  });
});

test("halves are the nearest there are, and bounded", () => {
  for (const x of [0, 1, -1, 0.5, 0.333, -0.0457, 123.4, 2 ** -14])
    expect(Math.abs(fromHalf(toHalf(x)) - x)).toBeLessThanOrEqual(Math.abs(x) / 2048);
  expect(fromHalf(toHalf(1e9))).toBeLessThanOrEqual(6.1e4);
  expect(fromHalf(toHalf(-1e9))).toBeGreaterThanOrEqual(-6.1e4);
  expect(fromHalf(toHalf(1e-9))).toBe(0);
});

/** Vertex numbers count two for each point. */
function distanceToSegment(rest: Float32Array, v: number, from: number, to: number): number {
  const along = [0, 1, 2].map((a) => rest[2 * to + a] - rest[2 * from + a]);
  const away = [0, 1, 2].map((a) => rest[2 * v + a] - rest[2 * from + a]);
  const length2 = along.reduce((sum, x) => sum + x * x, 0) || 1e-20;
  const t = Math.min(Math.max(along.reduce((sum, x, a) => sum + x * away[a], 0) / length2, 0), 1);
  return Math.hypot(...away.map((x, a) => x - t * along[a]));
}
