import { describe, expect, it } from "vitest";
import { Deformer } from "../../src/hair/deform";
import { StrandLengths } from "../../src/hair/strandLengths";
import { HairnetError } from "../../src/hair/hairnetError";
import { expandDisplacements } from "../../src/hair/lattice";
import { blendAt, farCardBlend, rootBlend } from "../../src/hair/rootBlend";
import { farCardNormals, farCardTangents, restTangents } from "../../src/hair/restTangents";
import { decodeGroom } from "../../src/net/groomFile";
import type { GeometryVector } from "../support/shapes";
import { fullGrid, geometryOf } from "../support/shapes";
import { fromHex, furthest, vectors } from "../support/vectors";

const kPointM = 1e-6;
// Of numbers about 1, and of slopes times displacements about 20 times as large.
const kTangent = 2e-5;

interface FfdVector {
  kind: "quadratic" | "linear";
  geometry: GeometryVector;
  active: number[];
  grid: number[];
  points: number[];
  blend: number[];
  direction: number[];
  blendSlope: number[];
  deformed: number[];
  tangents: number[];
}

interface GroomVector {
  file: string;
  rootBlend: number[];
  farCards: { blend: number[]; direction: number[]; blendSlope: number[]; normals: number[] };
  direction: number[];
  blendSlope: number[];
  geometry: GeometryVector;
  grid: number[];
  deformed: number[];
  limited: number[];
  tangents: number[];
}

describe("FFD", () => {
  it("moves points in and out of the lattice as core's reference does, with their tangents", () => {
    for (const each of vectors<FfdVector[]>("ffd.json")) {
      const { lattice } = geometryOf(each.geometry);
      const rest = {
        direction: Float32Array.from(each.direction),
        blendSlope: Float32Array.from(each.blendSlope),
      };
      const points = Float32Array.from(each.points);
      const deformer = new Deformer(lattice, points, Float32Array.from(each.blend), each.kind, rest);
      const out = { points: new Float32Array(points.length), tangents: new Float32Array(points.length) };
      deformer.deform(Float32Array.from(each.grid), out);
      expect(furthest(out.points, each.deformed)).toBeLessThan(kPointM);
      expect(furthest(out.tangents, each.tangents)).toBeLessThan(kTangent);
    }
  });

  it("gives trimmed nodes the displacements that core gives them", () => {
    for (const each of vectors<FfdVector[]>("ffd.json")) {
      const geometry = geometryOf(each.geometry);
      const grid = new Float32Array(each.grid.length);
      expandDisplacements(geometry, Float32Array.from(each.active), grid);
      expect(furthest(grid, each.grid)).toBeLessThan(kPointM / 4);
    }
  });

  it("reproduces a linear displacement exactly, inside and outside", () => {
    const geometry = fullGrid([4, 4, 4]);
    const grid = new Float32Array(3 * 64);
    for (let node = 0; node < 64; ++node) grid[3 * node] = 0.1 * (node % 4) * 0.1; // u_x = 0.1 x
    for (const kind of ["quadratic", "linear"] as const) {
      const points = Float32Array.from([-0.2, 0.1, 0.1, 0.13, 0.2, 0.05, 0.9, -0.4, 0.7]);
      const out = { points: new Float32Array(9) };
      new Deformer(geometry.lattice, points, null, kind).deform(grid, out);
      for (let p = 0; p < 3; ++p) expect(out.points[3 * p]).toBeCloseTo(1.1 * points[3 * p], 6);
    }
  });

  it("refuses lattices, points and room that do not fit", () => {
    const { lattice } = fullGrid([2, 3, 3]);
    expect(() => new Deformer(lattice, new Float32Array(3), null, "quadratic")).toThrow(HairnetError);
    expect(() => new Deformer(lattice, new Float32Array(4), null, "linear")).toThrow(HairnetError);
    const deformer = new Deformer(lattice, new Float32Array(3), null, "linear");
    expect(() => deformer.deform(new Float32Array(3), { points: new Float32Array(3) })).toThrow(HairnetError);
    const room = { points: new Float32Array(3), tangents: new Float32Array(3) };
    expect(() => deformer.deform(new Float32Array(54), room)).toThrow(HairnetError);
  });
});

describe("whole grooms", () => {
  it("have core's root blend and rest tangents, and are deformed as core deforms them", () => {
    for (const each of vectors<GroomVector[]>("grooms.json")) {
      const groom = decodeGroom(fromHex(each.file));
      const blend = rootBlend(groom);
      const rest = restTangents(groom, blend);
      expect(furthest(blend, each.rootBlend)).toBeLessThan(2e-6);
      expect(furthest(rest.direction, each.direction)).toBeLessThan(1e-6);
      for (let p = 0; p < blend.length; ++p)
        expect(Math.abs(rest.blendSlope[p] - each.blendSlope[p])).toBeLessThan(
          1e-5 * (10 + Math.abs(each.blendSlope[p])),
        );
      const deformer = new Deformer(geometryOf(each.geometry).lattice, groom.points, blend, "quadratic", rest);
      const out = { points: new Float32Array(groom.points.length), tangents: new Float32Array(groom.points.length) };
      deformer.deform(Float32Array.from(each.grid), out);
      expect(furthest(out.points, each.deformed)).toBeLessThan(kPointM);
      expect(furthest(out.tangents, each.tangents)).toBeLessThan(2e-4); // slopes of grooms made at random are steep
    }
  });

  it("are cut to their length at rest as core cuts them", () => {
    let moved = 0;
    for (const each of vectors<GroomVector[]>("grooms.json")) {
      const groom = decodeGroom(fromHex(each.file));
      const points = Float32Array.from(each.deformed);
      new StrandLengths(groom.points, groom.strands.begin).limit(points);
      expect(furthest(points, each.limited)).toBeLessThan(kPointM);
      moved = Math.max(moved, furthest(points, each.deformed));
    }
    expect(moved).toBeGreaterThan(1e-3);
  });

  it("stay as they are at rest, to the bit", () => {
    for (const each of vectors<GroomVector[]>("grooms.json")) {
      const { points, strands } = decodeGroom(fromHex(each.file));
      const limited = points.slice();
      new StrandLengths(points, strands.begin).limit(limited);
      expect(limited).toEqual(points);
    }
  });

  it("have core's root blend, tangents and normals of far cards", () => {
    let count = 0;
    for (const each of vectors<GroomVector[]>("grooms.json")) {
      const groom = decodeGroom(fromHex(each.file));
      const blend = farCardBlend(groom);
      const rest = farCardTangents(groom.farCards, blend);
      expect(furthest(blend, each.farCards.blend)).toBeLessThan(2e-6);
      expect(furthest(rest.direction, each.farCards.direction)).toBeLessThan(1e-6);
      for (let p = 0; p < blend.length; ++p) {
        const slope = each.farCards.blendSlope[p];
        expect(Math.abs(rest.blendSlope[p] - slope)).toBeLessThan(1e-5 * (10 + Math.abs(slope)));
      }
      // A cross product of nearly parallel vectors is no more precise.
      expect(furthest(farCardNormals(groom.farCards, rest), each.farCards.normals)).toBeLessThan(1e-3);
      count += groom.farCards.cards.length;
    }
    expect(count).toBeGreaterThan(20);
  });

  it("let go of the skull along the curves that core draws", () => {
    for (const each of vectors<{ curve: number[]; ratios: number[]; delta: number[] }[]>("root_blend.json")) {
      const delta = each.ratios.map((ratio) => blendAt(each.curve, ratio));
      expect(furthest(delta, each.delta)).toBeLessThan(1e-12);
    }
  });
});
