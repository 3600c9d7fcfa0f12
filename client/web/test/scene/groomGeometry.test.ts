import { describe, expect, test } from "vitest";
import { buffersOf, makeGroomGeometry } from "../../src/scene/geometry/groomGeometry";
import { toHalf } from "../../src/scene/geometry/half";
import { LightField } from "../../src/scene/geometry/lightField";
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
    const vertices = strands.rest.length / 4;
    expect(vertices).toBeGreaterThanOrEqual(2 * groom.points.length / 3);
    for (let v = 0; v < vertices; v += 2) {
      for (let n = 0; n < 4; ++n) expect(strands.rest[4 * v + n]).toBe(strands.rest[4 * v + 4 + n]);
      expect(strands.rest[4 * v + 3]).toBeGreaterThanOrEqual(0);
      expect(strands.rest[4 * v + 3]).toBeLessThanOrEqual(1);
    }
    const drawn = new Set(Array.from({ length: vertices }, (_, v) => strands.rest.subarray(4 * v, 4 * v + 3).join()));
    for (let p = 0; p < groom.points.length; p += 3) expect(drawn).toContain(groom.points.subarray(p, p + 3).join());
  });

  test("draws a prefix of its list as so many whole strands, spread over the head", () => {
    const [all] = geometry.strandLists;
    expect(all.end).toHaveLength(geometry.strandCount + 1);
    expect(all.end[geometry.strandCount]).toBe(all.triangles.length);
    const half = geometry.strandCount / 2;
    const drawn = new Set(Array.from(all.triangles.subarray(0, all.end[half]), (v) => strands.extra[v]));
    expect([...drawn].sort((a, b) => a - b)).toEqual(Array.from({ length: half }, (_, n) => n));
    let left = 0;
    for (const v of all.triangles.subarray(0, all.end[half])) if (strands.rest[4 * v] < 0) ++left;
    expect(left / all.end[half]).toBeGreaterThan(0.3);
    expect(left / all.end[half]).toBeLessThan(0.7);
  });

  test("keeps to the tolerance of each list and needs fewer points for a larger one", () => {
    const [all, ...coarser] = geometry.strandLists;
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
    const { strandLists, strands } = makeGroomGeometry(long);
    for (const { triangles, toleranceM } of strandLists)
      for (let t = 0; t < triangles.length; t += 6) {
        const [from, to] = [triangles[t], triangles[t + 2]];
        for (let v = from + 2; v < to; v += 2)
          if (distanceToSegment(strands.rest, v, from, to) > toleranceM) expect.fail(`point ${v} is further off than ${toleranceM}`);
      }
    expect(strandLists[2].triangles.length).toBeLessThan(strandLists[0].triangles.length);
  });

  test("gives tangents of unit length along the strand", () => {
    for (let v = 0; v + 2 < strands.rest.length / 4; v += 2) {
      if (strands.extra[v] !== strands.extra[v + 2]) continue;
      const t = [0, 1, 2].map((axis) => fromHalf(strands.direction[4 * v + axis]));
      expect(Math.hypot(...t)).toBeCloseTo(1, 2);
      const step = [0, 1, 2].map((axis) => strands.rest[4 * v + 8 + axis] - strands.rest[4 * v + axis]);
      expect(t.reduce((sum, x, axis) => sum + x * step[axis], 0)).toBeGreaterThan(0.8 * Math.hypot(...step));
    }
  });

  test("names each buffer once for a worker to hand over", () => {
    const buffers = buffersOf(geometry);
    expect(new Set(buffers).size).toBe(buffers.length);
    expect(buffers).toContain(strands.rest.buffer);
  });

  test("adds the copies of clusters within their radius of the strand", () => {
    const clustered = makeGroomGeometry({
      ...groom,
      clusters: [{ strand: 3, copyCount: 5, radiusM: 0.004, tipRadiusM: 0.002 }],
    });
    expect(clustered.strandCount).toBe(45);
    const own = groom.points.subarray(3 * groom.strands.begin[3], 3 * groom.strands.begin[4]);
    const near = (v: number) => {
      for (let i = 0; i < own.length; i += 3)
        if (Math.hypot(...[0, 1, 2].map((a) => own[i + a] - clustered.strands.rest[4 * v + a])) <= 0.0045) return true;
      return false;
    };
    const strandsNear = new Set<number>();
    for (const v of clustered.strandLists[0].triangles) if (near(v)) strandsNear.add(clustered.strands.extra[v]);
    expect(strandsNear.size).toBe(6);
  });
});

describe("the light field", () => {
  test("leaves light outside and takes it inside, from the side that hair and skull are on", () => {
    const light = new LightField(madeGroom(2000, 12), 4e-3);
    const out = new Float32Array(6);
    expect([...light.at(0, 2, 0, out)]).toEqual([1, 1, 1, 1, 1, 1]);
    light.at(0.07, 0.05, 0, out);
    expect(out[0]).toBeGreaterThan(out[1]); // +x is outwards here, the skull lies at -x
    for (const left of out) expect(left).toBeGreaterThanOrEqual(0);
    for (const left of out) expect(left).toBeLessThanOrEqual(1.001);
  });

  test("of a groom that is the same on both sides is the same on both sides, but for its cells", () => {
    const light = new LightField(madeGroom(400, 12, 0), 4e-3);
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
    const light = new LightField(madeGroom(0, 12), 4e-3);
    expect([...light.at(0, 0.1, 0, new Float32Array(6))]).toEqual([1, 1, 1, 1, 1, 1]);
    expect(light.rootsAt(0, 0.1, 0)).toBe(0);
  });
});

test("halves are the nearest there are, and bounded", () => {
  for (const x of [0, 1, -1, 0.5, 0.333, -0.0457, 123.4, 2 ** -14])
    expect(Math.abs(fromHalf(toHalf(x)) - x)).toBeLessThanOrEqual(Math.abs(x) / 2048);
  expect(fromHalf(toHalf(1e9))).toBeLessThanOrEqual(6.1e4);
  expect(fromHalf(toHalf(-1e9))).toBeGreaterThanOrEqual(-6.1e4);
  expect(fromHalf(toHalf(1e-9))).toBe(0);
});

function distanceToSegment(rest: Float32Array, v: number, from: number, to: number): number {
  const along = [0, 1, 2].map((a) => rest[4 * to + a] - rest[4 * from + a]);
  const away = [0, 1, 2].map((a) => rest[4 * v + a] - rest[4 * from + a]);
  const length2 = along.reduce((sum, x) => sum + x * x, 0) || 1e-20;
  const t = Math.min(Math.max(along.reduce((sum, x, a) => sum + x * away[a], 0) / length2, 0), 1);
  return Math.hypot(...away.map((x, a) => x - t * along[a]));
}
