import { describe, expect, test } from "vitest";
import { DataUtils } from "three";
import { kPointRow } from "../../src/generated/constants";
import { buffersOf } from "../../src/scene/geometry/groomGeometry";
import { makeGroomGeometry } from "../../src/scene/geometry/makeGroomGeometry";
import { toHalf } from "../../src/scene/geometry/half";
import { OcclusionGrid } from "../../src/scene/geometry/occlusionGrid";
import { Scalp } from "../../src/scene/geometry/scalp";
import { madeGroom } from "../support/madeGroom";

describe("a groom's geometry", () => {
  const groom = madeGroom(40, 12);
  const geometry = makeGroomGeometry(groom);
  const { strands } = geometry;

  test("fills whole rows of points", () => {
    expect(strands.rest.length % (4 * kPointRow)).toBe(0);
    expect(strands.arc.length / 2).toBe(strands.rest.length / 4);
  });

  test("keeps to the tolerance of each list on a strand of very many points, each further off than all before", () => {
    const count = 40_000;
    const long = madeGroom(1, count);
    for (let i = 0; i < count; ++i) long.points[3 * i] = ((i % 2 ? 0.05 : -0.05) * i) / count;
    const { lists, rest } = makeGroomGeometry(long).strands;
    for (const { triangles, toleranceM } of lists)
      for (let t = 0; t < triangles.length; t += 6) {
        const [from, to] = [triangles[t], triangles[t + 2]];
        for (let v = from + 2; v < to; v += 2)
          if (distanceToSegment(rest, v, from, to) > toleranceM)
            expect.fail(`point ${v} is further off than ${toleranceM}`);
      }
    expect(lists[2].triangles.length).toBeLessThan(lists[0].triangles.length);
  });

  test("names each buffer once for a worker to hand over", () => {
    const buffers = buffersOf(geometry);
    expect(new Set(buffers).size).toBe(buffers.length);
    expect(buffers).toContain(strands.rest.buffer);
  });
});

test("where there is no hair, light is left whole and there is no scalp", () => {
  const bald = madeGroom(0, 12);
  expect([...new OcclusionGrid(bald, 4e-3).at(0, 0.1, 0, new Float32Array(6))]).toEqual([1, 1, 1, 1, 1, 1]);
  expect(new Scalp(bald).at(0, 0.16, 0.09)).toBe(0);
});

const { fromHalfFloat: fromHalf } = DataUtils;

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
