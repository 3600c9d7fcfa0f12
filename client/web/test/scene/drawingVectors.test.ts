// What client/render makes of the same grooms, sizes and cameras in C++: tests/tools/web_drawing.cpp.
import { describe, expect, test } from "vitest";
import { Box3, DataUtils, PerspectiveCamera, Texture } from "three";
import { kStrayM } from "../../src/generated/constants";
import { ModeLattice } from "../../src/hair/movedLattice";
import { decodeGroom } from "../../src/net/groomFile";
import { writeRecord } from "../../src/scene/characterRecords";
import { densityGrid, movedBox } from "../../src/scene/densityGrid";
import { detailFor, widthScale, type DrawDetail } from "../../src/scene/drawDetail";
import { makeGroomGeometry } from "../../src/scene/geometry/makeGroomGeometry";
import type { MeshArrays } from "../../src/scene/geometry/meshBuilder";
import { OcclusionGrid } from "../../src/scene/geometry/occlusionGrid";
import { Scalp } from "../../src/scene/geometry/scalp";
import { LatticePass } from "../../src/scene/latticePass";
import { modeTexels } from "../../src/scene/modeTexels";
import { makeLightRig, studioLights } from "../../src/scene/lightRig";
import { geometryOf, type GeometryVector } from "../support/shapes";
import { fromHex, furthest, vectors } from "../support/vectors";

/** Arrays of numbers are in hexadecimal, as they lie in memory. */
type Digits<Names extends string> = Record<Names, string>;
type MeshVector = Digits<"rest" | "direction" | "sides" | "ends" | "triangles">;

interface GeometryCase extends Digits<"file" | "places" | "normals" | "open" | "onSurface" | "scalp"> {
  cellM: number;
  geometry: {
    strands: Digits<"rest" | "arc" | "pointEnd" | "sides" | "ends" | "strand"> & {
      lists: (Digits<"triangles" | "end"> & { toleranceM: number })[];
    };
    cards: MeshVector & Digits<"side">;
    farCards: MeshVector & Digits<"side">;
    fabric: MeshVector & Digits<"albedo" | "cord">;
    body: MeshVector & Digits<"shares">;
  } & Record<"strandCount" | "strandWidthM" | "farCardCount" | "waviness" | "radiusM", number>;
}
interface Vectors {
  geometry: GeometryCase[];
  detail: string;
  lights: Record<"eye" | "target" | "towards" | "colours" | "ambient", number[]>[];
  record: {
    pose: number[];
    hairAlbedo: [number, number, number];
    hairTipAlbedo: [number, number, number];
    roughness: number;
    skinAlbedo: [number, number, number];
    strandWidthM: number;
    detail: DrawDetail;
    pointRows: { first: number; count: number };
    strandBox: number[];
    rootBox: number[];
    lattice: { geometry: GeometryVector; grid: number[] };
    record: string;
    uploadedNodes: string;
    inModes: { geometry: GeometryVector; nodeCount: number; coefficients: number[]; record: string } & Record<
      "deviationM" | "unit" | "modes",
      number[]
    > & { texels: string };
  };
}

const floats = (digits: string) => new Float32Array(fromHex(digits).buffer);
const indices = (digits: string) => new Uint32Array(fromHex(digits).buffer);
const shorts = (digits: string) => new Uint16Array(fromHex(digits).buffer);
const numbers = (halves: Uint16Array) => Array.from(halves, DataUtils.fromHalfFloat);
const corners = (digits: string) => Uint32Array.from(shorts(digits));

// C++ calculates in float, TypeScript in double, and both store floats, halves or bytes: what they store may differ in
// its last place. Behind each bound is the largest difference that was measured.
const kPointM = 2e-7; // 6e-8: the last place of a float below 1 m
const kArcM = 2e-6; // 1e-6: sums of floats up to 3 m
const kHalf = 5e-4; // 5e-5: halves below 6e-5 are 0 here; the last place below 1 is 5e-4
const kByte = 1; // 1
const kLight = 1e-5; // 2.6e-6: sums over cells
const kDetail = 1e-5; // 1.2e-6, of numbers up to 12
const kDirection = 1e-6; // 1.5e-7

function near(name: string, a: ArrayLike<number>, b: ArrayLike<number>, most: number) {
  expect(furthest(a, b), name).toBeLessThanOrEqual(most);
}

/** Numbers `first` to `first + size` of each run of `every`. */
function column(values: ArrayLike<number>, every: number, first: number, size: number): number[] {
  return Array.from(values).filter((_, i) => i % every >= first && i % every < first + size);
}

function expectMesh(name: string, mesh: MeshArrays, vector: MeshVector, restSize = 4): void {
  expect(mesh.triangles, name).toEqual(corners(vector.triangles));
  near(`${name} rest`, column(mesh.rest, 4, 0, restSize), floats(vector.rest), kPointM);
  near(`${name} direction`, numbers(mesh.direction), numbers(shorts(vector.direction)), kHalf);
  near(`${name} sides`, mesh.sides, fromHex(vector.sides), kByte);
  near(`${name} ends`, mesh.ends, fromHex(vector.ends), kByte);
}

const all = vectors<Vectors>("drawing.json");

describe.each(all.geometry.map((vector) => ({ vector, groom: decodeGroom(fromHex(vector.file)) })))(
  "of $groom.name",
  ({ vector, groom }) => {
    const geometry = makeGroomGeometry(groom);
    const expected = vector.geometry;

    test("strands have the same points, in the same order, and the same of them are drawn", () => {
      const { strands } = geometry;
      expect(geometry.strandCount).toBe(expected.strandCount);
      expect(geometry.strandWidthM).toBeCloseTo(expected.strandWidthM, 9);
      expect(strands.pointEnd).toEqual(indices(expected.strands.pointEnd));
      const points = strands.strand.length / 2;
      near("strand rest", strands.rest.subarray(0, 4 * points), floats(expected.strands.rest), kPointM);
      near("strand arc", strands.arc.subarray(0, 2 * points), floats(expected.strands.arc), kArcM);
      for (const first of [0, 1]) {
        // left and right
        near("strand sides", column(strands.sides, 8, 4 * first, 4), fromHex(expected.strands.sides), kByte);
        near("strand ends", column(strands.ends, 8, 4 * first, 4), fromHex(expected.strands.ends), kByte);
        near("strand", column(strands.strand, 2, first, 1), floats(expected.strands.strand), 0);
      }
      expect(strands.lists).toHaveLength(expected.strands.lists.length);
      strands.lists.forEach((list, n) => {
        expect(list.toleranceM).toBeCloseTo(expected.strands.lists[n].toleranceM, 9);
        expect(list.end).toEqual(indices(expected.strands.lists[n].end));
        expect(list.triangles).toEqual(corners(expected.strands.lists[n].triangles));
      });
    });

    test("cards, far cards, fabric and body are the same", () => {
      for (const name of ["cards", "farCards"] as const) {
        expectMesh(name, geometry[name], expected[name]);
        near(`${name} side`, geometry[name].extra, floats(expected[name].side), kPointM);
      }
      expect(geometry.farCardCount).toBe(expected.farCardCount);
      expectMesh("fabric", geometry.fabric, expected.fabric);
      near("fabric albedo", column(geometry.fabric.extra, 5, 0, 4), floats(expected.fabric.albedo), 0);
      near("fabric cord", column(geometry.fabric.extra, 5, 4, 1), floats(expected.fabric.cord), 0);
      expectMesh("body", geometry.body, expected.body, 3);
      near(
        "body shares",
        geometry.body.extra.map((share) => Math.round(255 * share)),
        fromHex(expected.body.shares),
        kByte,
      );
      near("waviness", [geometry.waviness], [expected.waviness], kDetail);
      near("radius", [geometry.radiusM], [expected.radiusM], kPointM);
    });

    test("as much light and scalp is at every place", () => {
      const occlusion = new OcclusionGrid(groom, 1e-3);
      const scalp = new Scalp(groom);
      const places = floats(vector.places);
      const normals = floats(vector.normals);
      const open = new Float32Array(2 * places.length);
      const onSurface = new Float32Array(2 * places.length);
      const shares = new Float32Array(places.length / 3);
      for (let p = 0; p < shares.length; ++p) {
        const [x, y, z] = places.subarray(3 * p, 3 * p + 3);
        occlusion.at(x, y, z, open.subarray(6 * p, 6 * p + 6));
        occlusion.at(x, y, z, onSurface.subarray(6 * p, 6 * p + 6), [...normals.subarray(3 * p, 3 * p + 3)]);
        shares[p] = scalp.at(x, y, z);
      }
      expect(occlusion.cellM).toBeCloseTo(vector.cellM, 8);
      near("open", open, floats(vector.open), kLight);
      near("on surface", onSurface, floats(vector.onSurface), kLight);
      near("scalp", shares, floats(vector.scalp), kLight);
    });
  },
);

test("every size, quality, number and waviness of hair is drawn in the same detail", () => {
  const cases = floats(all.detail);
  for (let at = 0; at < cases.length; at += 10) {
    const [px, quality, strands, waviness, ...expected] = cases.subarray(at, at + 10);
    const detail = detailFor(px, quality, strands, waviness);
    const { strandShare, followHairCount, toleranceM, quadratic, cards } = detail;
    near("detail", [strandShare, followHairCount, toleranceM, quadratic, cards, widthScale(detail)], expected, kDetail);
  }
});

test("the studio's lights stand in the same places about the camera and have the same colours", () => {
  const rig = makeLightRig();
  const camera = new PerspectiveCamera();
  for (const { eye, target, towards, colours, ambient } of all.lights) {
    camera.position.fromArray(eye);
    camera.lookAt(target[0], target[1], target[2]);
    camera.updateMatrixWorld();
    studioLights(camera, rig);
    near(
      "towards",
      rig.towards.flatMap((light) => light.toArray()),
      towards,
      kDirection,
    );
    near(
      "colours",
      rig.colours.flatMap((light) => light.toArray()),
      colours,
      kDirection,
    );
    near(
      "ambient",
      [rig.ambientAbove, rig.ambientBelow].flatMap((light) => light.toArray()),
      ambient,
      kDirection,
    );
  }
});

test("a character's record and its lattice lie in textures as in C++", () => {
  const { pose, strandWidthM, lattice, record, uploadedNodes, inModes, strandBox, rootBox, ...same } = all.record;
  const pass = new LatticePass(new Texture());
  const moved = { geometry: geometryOf(lattice.geometry), grid: Float32Array.from(lattice.grid) };
  const { geometry, ...numbersOf } = inModes;
  const basis = {
    nodeCount: numbersOf.nodeCount,
    deviationM: Float32Array.from(numbersOf.deviationM),
    unit: Float32Array.from(numbersOf.unit),
    modes: Int16Array.from(numbersOf.modes),
  };
  const summed = new ModeLattice({ geometry: geometryOf(geometry), basis, skin: [] });
  summed.show(Float32Array.from(numbersOf.coefficients));
  pass.begin([moved, summed], 2048);
  const placed = pass.add(0, 0)!;
  const out = new Float32Array(floats(record).length);
  const box = (ends: number[]) => new Box3().setFromArray(ends);
  const density = densityGrid(movedBox(box(strandBox), box(rootBox), moved), 3, 1e-3);
  const widthM = strandWidthM * widthScale(same.detail);
  const written = {
    ...same,
    pose: Float64Array.from(pose),
    widthM,
    strayM: kStrayM,
    size: 1,
    bodyVisible: false,
    lattice: placed,
    density,
  };
  writeRecord(written, out);
  // The weight of strands in the grid of density is about 30.
  const expected = floats(record);
  const weightAt = 4 * 15 + 3;
  expect(out[weightAt] / expected[weightAt]).toBeCloseTo(1, 6);
  out[weightAt] = expected[weightAt];
  near("record", out, expected, kDirection);
  near("uploaded nodes", pass.uploadedNodes.subarray(0, floats(uploadedNodes).length), floats(uploadedNodes), 0);
  // The same character with a lattice of modes is the next.
  writeRecord({ ...written, lattice: pass.add(1, 1)! }, out);
  out[weightAt] = floats(inModes.record)[weightAt];
  near("record with modes", out, floats(inModes.record), kDirection);
  near("modes", modeTexels(summed.geometry, basis), floats(inModes.texels), 1e-5); // of up to 20
});
