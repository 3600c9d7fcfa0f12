// What client/draw makes of the same sizes, cameras and characters in C++: tests/tools/web_drawing.cpp.
import { describe, expect, test } from "vitest";
import { Box3, PerspectiveCamera, Texture } from "three";
import { kStrayM } from "../../src/generated/constants";
import type { MovedLattice } from "../../src/hair/movedLattice";
import { writeRecord } from "../../src/scene/characterRecords";
import { densityGrid, movedBox } from "../../src/scene/densityGrid";
import { detailFor, widthScale, type DrawDetail } from "../../src/scene/drawDetail";
import { LatticePass } from "../../src/scene/latticePass";
import { makeLightRig, studioLights } from "../../src/scene/lightRig";
import { geometryOf } from "../support/grooms";
import { fromHex, furthest, vectors } from "../support/vectors";

interface LatticeVector {
  geometry: { lattice: { origin: number[]; spacing: number[]; dims: [number, number, number] } };
}
/** Arrays of numbers in a text are in hexadecimal, as they lie in memory. */
type Digits<Names extends string> = Record<Names, string>;
type Meshes = "cards" | "farCards" | "fabric" | "body";
interface Vectors {
  geometry: {
    file: string;
    geometry: Record<Meshes, Record<string, string>> & {
      strands: Digits<"rest" | "arc" | "pointEnd" | "sides" | "ends" | "strand"> & {
        lists: (Digits<"triangles" | "end"> & { toleranceM: number })[];
      };
    } & Record<"strandCount" | "strandWidthM" | "farCardCount" | "waviness" | "radiusM", number>;
  }[];
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
    lattice: LatticeVector & { grid: number[] };
    record: string;
    uploadedNodes: string;
    inModes: LatticeVector & { unit: number[]; coefficients: number[]; record: string; texels: string };
  };
}

const floats = (digits: string) => new Float32Array(fromHex(digits).buffer as ArrayBuffer);

// C++ calculates in float, TypeScript in double. Behind each bound is the largest difference that was measured.
const kDetail = 1e-5; // 1.2e-6, of numbers up to 12
const kDirection = 1e-6; // 1.5e-7
// The vectors are of another processor, with another exponential function.
const kPointM = 2e-7; // 6e-8: the last place of a float below 1 m
const kLight = 1; // of 255: 1

function near(name: string, a: ArrayLike<number>, b: ArrayLike<number>, most: number) {
  expect(furthest(a, b), name).toBeLessThanOrEqual(most);
}

const all = vectors<Vectors>("drawing.json");

describe.each(all.geometry)("the geometry of groom %#", async ({ file, geometry: expected }) => {
  const geometry = await geometryOf(fromHex(file));
  type Numbers = Float32Array | Uint32Array | Uint16Array | Uint8Array;
  const expectNumbers = (name: string, array: Numbers, digits: string) => {
    const wanted = new (array.constructor as new (bytes: ArrayBufferLike) => Numbers)(fromHex(digits).buffer);
    const most = array instanceof Float32Array ? kPointM : array instanceof Uint8Array ? kLight : 0;
    near(name, array.subarray(0, wanted.length), wanted, most);
  };

  test("has the strands that C++ makes", () => {
    const { strands } = geometry;
    for (const name of ["strandCount", "strandWidthM", "farCardCount", "waviness", "radiusM"] as const)
      expect(geometry[name], name).toBeCloseTo(expected[name], 6);
    for (const name of ["rest", "arc", "pointEnd"] as const) expectNumbers(name, strands[name], expected.strands[name]);
    for (const name of ["sides", "ends", "strand"] as const) {
      const { array, size } = strands.attributes[name];
      // Each point has two equal vertices.
      expectNumbers(
        name,
        array.filter((_, n) => Math.floor(n / size) % 2 === 0),
        expected.strands[name],
      );
    }
    expect(strands.lists).toHaveLength(expected.strands.lists.length);
    for (const [n, list] of strands.lists.entries()) {
      const { toleranceM, end, triangles } = expected.strands.lists[n];
      expect(list.toleranceM).toBeCloseTo(toleranceM, 6);
      expectNumbers("end", list.end, end);
      expect(Array.from(list.triangles)).toEqual(Array.from(new Uint16Array(fromHex(triangles).buffer as ArrayBuffer)));
    }
  });

  test("has the cards, cloths and body that C++ makes", () => {
    for (const name of ["cards", "farCards", "fabric", "body"] as const) {
      const { attributes, triangles } = geometry[name];
      for (const [each, { array }] of Object.entries(attributes))
        expectNumbers(`${name} ${each}`, array, expected[name][each === "normal" ? "direction" : each]);
      expect(Array.from(triangles)).toEqual(
        Array.from(new Uint16Array(fromHex(expected[name].triangles).buffer as ArrayBuffer)),
      );
    }
  });
});

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
  const moved: MovedLattice = { lattice: lattice.geometry.lattice, grid: Float32Array.from(lattice.grid) };
  const summed: MovedLattice = {
    lattice: inModes.geometry.lattice,
    grid: new Float32Array(0), // the GPU sums up
    modes: {
      basis: { modeCount: inModes.unit.length, texels: () => floats(inModes.texels) },
      coefficients: Float32Array.from(inModes.coefficients),
    },
  };
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
});
