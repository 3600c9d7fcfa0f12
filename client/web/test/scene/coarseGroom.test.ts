import { describe, expect, test } from "vitest";
import type { Groom } from "../../src/hair/groom";
import { validateGroom } from "../../src/hair/validateGroom";
import { coarseGroom } from "../../src/scene/geometry/coarseGroom";
import { makeGroomGeometry } from "../../src/scene/geometry/makeGroomGeometry";
import { madeGroom } from "../support/madeGroom";

/** Strands of 2 to 8 points that differ in everything, and one of each other part, which lies behind them. */
function variedGroom(count: number): Groom {
  const from = madeGroom(count, 8);
  const { strands } = from;
  const length = (s: number) => 2 + ((5 * s) % 7);
  const begin = new Uint32Array(count + 1);
  for (let s = 0; s < count; ++s) begin[s + 1] = begin[s] + length(s);
  const ownPoints = 12;
  const points = new Float32Array(3 * (begin[count] + ownPoints));
  for (let s = 0; s < count; ++s)
    points.set(from.points.subarray(3 * strands.begin[s], 3 * (strands.begin[s] + length(s))), 3 * begin[s]);
  const behind = (first: number, last: number) => ({ begin: begin[count] + first, end: begin[count] + last });
  const colour: [number, number, number] = [1, 0, 0];
  return {
    ...from,
    groupNames: ["left", "right"],
    points,
    strands: {
      count,
      begin,
      radiusM: Float32Array.from({ length: count }, (_, s) => 1e-5 * (1 + (s % 5))),
      hairCount: Float32Array.from({ length: count }, (_, s) => 1 + (s % 11)),
      rootLengthM: Float32Array.from({ length: count }, (_, s) => 0.001 * (s % 13)),
      group: Uint16Array.from({ length: count }, (_, s) => (s >> 4) & 1),
      rooted: Uint8Array.from({ length: count }, (_, s) => (s >> 5) & 1),
    },
    clumps: [{ strand: count - 1, copyCount: 3, radiusM: 0.004, tipRadiusM: 0.002 }],
    threads: [{ points: behind(0, 4), group: 1, rooted: true, rootLengthM: 0, radiusM: 0.001, colour }],
    cards: [{ points: behind(4, 8), group: 0, rooted: true, rootLengthM: 0, hairCount: 9 }],
    cloths: [
      {
        points: behind(8, 12),
        group: 0,
        triangles: Uint32Array.from([8, 9, 10], (i) => begin[count] + i),
        rootDistanceM: new Float32Array(0),
        rootLengthM: 0,
        colour,
        opacity: 1,
      },
    ],
    knots: [{ points: Uint32Array.of(0, begin[count] - 1, begin[count]) }],
  };
}

function pointsOf({ points, strands }: Groom, s: number): number[] {
  return [...points.subarray(3 * strands.begin[s], 3 * strands.begin[s + 1])];
}

describe("a coarse groom", () => {
  test.each([
    [2000, 4],
    [2001, 4],
    [2499, 4],
    [2500, 5],
  ])("of %i strands has each %ith, with all that belongs to it", (count, step) => {
    const groom = variedGroom(count);
    const coarse = coarseGroom(groom)!;
    expect(coarse.strands.count).toBe(Math.ceil(count / step));
    for (let i = 0; i < coarse.strands.count; ++i) {
      expect(pointsOf(coarse, i)).toEqual(pointsOf(groom, step * i));
      for (const part of ["radiusM", "hairCount", "rootLengthM", "group", "rooted"] as const)
        expect(coarse.strands[part][i], `${part} of strand ${i}`).toBe(groom.strands[part][step * i]);
    }
  });

  test("is a whole groom: nothing in it points at what it lacks, and geometry can be made of it", () => {
    const groom = variedGroom(2000);
    validateGroom(groom);
    const coarse = coarseGroom(groom)!;
    validateGroom(coarse);
    expect(coarse.points.length).toBe(3 * coarse.strands.begin[coarse.strands.count]);
    expect(coarse.body).toBe(groom.body);
    for (const part of ["clumps", "threads", "cards", "cloths", "knots"] as const) expect(coarse[part]).toEqual([]);
    expect(makeGroomGeometry(coarse).strands.rest.length).toBeGreaterThan(0);
  });

  test("shares no numbers of strands with the whole groom, which is handed over later", () => {
    const groom = variedGroom(2000);
    const { points, strands } = coarseGroom(groom)!;
    for (const part of [strands.begin, strands.radiusM, strands.hairCount, strands.rootLengthM, strands.group])
      expect(Object.values(groom.strands).map((each) => each.buffer)).not.toContain(part.buffer);
    expect(points.buffer).not.toBe(groom.points.buffer);
  });

  test("is not made of a groom that is quick to draw", () => {
    expect(coarseGroom(variedGroom(1999))).toBeNull();
  });
});
