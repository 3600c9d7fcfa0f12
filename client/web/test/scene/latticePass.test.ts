import { Texture } from "three";
import { describe, expect, test } from "vitest";
import { kLatticeRow } from "../../src/generated/constants";
import { displacementsOf, type HairBasis } from "../../src/hair/basis";
import { expandDisplacements, type LevelGeometry } from "../../src/hair/lattice";
import { ModeLattice, type MovedLattice } from "../../src/hair/movedLattice";
import { LatticePass } from "../../src/scene/latticePass";
import { modeTexels } from "../../src/scene/modeTexels";
import { nodeSumFor } from "../../src/scene/nodeSum";
import { fullGrid } from "../support/shapes";
import { furthest, seeded } from "../support/vectors";

/** The last node follows the first two. */
function someBasis(modeCount: number, dims: [number, number, number] = [3, 4, 5]): HairBasis {
  const random = seeded(modeCount);
  const whole = fullGrid(dims);
  const last = whole.activeNodes.length - 1;
  const geometry: LevelGeometry = {
    ...whole,
    activeNodes: whole.activeNodes.slice(0, last),
    trimmedNodes: Uint32Array.of(last),
    trimmedBegin: Uint32Array.of(0, 2),
    trimmedFrom: Uint32Array.of(0, 1),
    trimmedWeights: Float32Array.of(0.75, -0.5),
  };
  const basis = {
    nodeCount: last,
    deviationM: new Float32Array(modeCount).fill(0.1),
    unit: Float32Array.from({ length: modeCount }, (_, k) => 1e-4 * (1 + k)),
    modes: Int16Array.from({ length: 3 * modeCount * last }, () => 20000 * (random() - 0.5)),
  };
  return { geometry, basis, skin: [] };
}

function moved(hair: HairBasis, coefficients: ArrayLike<number>): ModeLattice {
  const lattice = new ModeLattice(hair);
  lattice.show(Float32Array.from(coefficients));
  return lattice;
}

function gridOf({ basis, geometry }: HairBasis, coefficients: Float32Array): Float32Array {
  const active = new Float32Array(3 * basis.nodeCount);
  displacementsOf(basis, coefficients, active);
  const grid = new Float32Array(3 * basis.nodeCount + 3);
  expandDisplacements(geometry, active, grid);
  return grid;
}

describe("a lattice in modes", () => {
  const hair = someBasis(100);
  const coefficients = Float32Array.from({ length: 100 }, (_, k) => 0.1 * Math.sin(k));

  test("has the nodes of what it shows", () => {
    const lattice = moved(hair, coefficients);
    expect(furthest(lattice.grid, gridOf(hair, coefficients))).toBe(0);
    lattice.show(coefficients.subarray(0, 3));
    expect(furthest(lattice.grid, gridOf(hair, coefficients.subarray(0, 3)))).toBe(0);
    lattice.show(new Float32Array(0));
    expect(lattice.grid.every((each) => each === 0)).toBe(true);
  });

  test("has a coarse one, of the first coefficients", () => {
    const lattice = moved(hair, coefficients);
    expect(furthest(lattice.coarse!.grid, gridOf(hair, coefficients.subarray(0, 64)))).toBe(0);
    lattice.show(coefficients.subarray(0, 3));
    expect(furthest(lattice.coarse!.grid, lattice.grid)).toBe(0);
    expect(lattice.coarse!.coarse).toBeUndefined();
  });
});

test("the texels of modes add up to the nodes", () => {
  const hair = someBasis(7);
  const texels = modeTexels(hair.geometry, hair.basis);
  expect(texels.length).toBe(4 * kLatticeRow * 8); // modes in fours
  const coefficients = Float32Array.of(0.3, -0.2, 0.1, 0, 0.05, 0.4, -0.3);
  const expected = gridOf(hair, coefficients);
  const sum = expected.map((_, i) =>
    coefficients.reduce((u, c, k) => u + c * texels[4 * (kLatticeRow * k + Math.floor(i / 3)) + (i % 3)], 0),
  );
  expect(furthest(sum, expected)).toBeLessThan(1e-6);
  expect(furthest(expected, new Float32Array(expected.length))).toBeGreaterThan(0.5);
});

describe("places of lattices", () => {
  const hair = someBasis(6);
  const large = someBasis(5, [11, 11, 11]);
  const nodes = { geometry: hair.geometry, grid: new Float32Array(180).fill(0.5) };

  test("have rows of their own, the number of their basis, and what they are the sum of", () => {
    const pass = new LatticePass(new Texture());
    const lattices = [moved(hair, [0.1, 0, 0.2, 0, 0]), moved(large, [0.3]), nodes, moved(hair, [])];
    pass.begin(lattices, 2048);
    const places = lattices.map((_, number) => pass.add(number, number)!);
    expect(places.map(({ firstNode }) => firstNode / kLatticeRow)).toEqual([0, 1, 3, 4]);
    expect(places.map(({ basis }) => basis)).toEqual([1, 2, 0, 1]);
    expect(places.map(({ coefficients }) => [...coefficients])).toEqual([
      [0.1, 0, 0.2].map(Math.fround),
      [Math.fround(0.3)],
      [],
      [],
    ]);
    expect([...pass.uploadedNodes.subarray(0, 3)]).toEqual([0.5, 0.5, 0.5]);
  });

  test("are not for lattices that are not finite", () => {
    const pass = new LatticePass(new Texture());
    const lattices = [
      moved(hair, [0.1, NaN]),
      moved(hair, [1e30]),
      { ...nodes, grid: new Float32Array(180).fill(NaN) },
      { ...nodes, grid: new Float32Array(180).fill(Infinity) },
    ];
    pass.begin([...lattices, nodes], 2048);
    for (const number of lattices.keys()) expect(pass.add(number, 0)).toBeNull();
    expect(pass.add(lattices.length, 0)).toMatchObject({ firstNode: kLatticeRow * lattices.length, uploadedRow: 0 });
  });

  test("end with the rows of a texture; a basis that has no room there is summed up before", () => {
    const pass = new LatticePass(new Texture());
    const lattice = moved(large, [0.3, 0.1]);
    pass.begin([lattice, lattice], 3);
    expect(pass.add(0, 0)).toMatchObject({ basis: 0 });
    expect(furthest(pass.uploadedNodes.subarray(0, 3), lattice.grid.subarray(0, 3))).toBe(0);
    expect(pass.add(1, 1)).toBeNull();
  });

  test("keep a basis while a character has it, seen or not", () => {
    const pass = new LatticePass(new Texture());
    const one = moved(hair, [0.1]);
    pass.begin([one], 2048);
    pass.add(0, 0);
    const { basisBytes } = pass;
    expect(basisBytes).toBe(16 * kLatticeRow * 8);
    pass.begin([one], 2048);
    expect(pass.basisBytes).toBe(basisBytes);
    pass.begin([null, nodes], 2048);
    expect(pass.basisBytes).toBe(0);
  });

  test.each(["gpu", "processor"] as const)("keep their nodes while the hair sleeps, summed up by the %s", (sum) => {
    const pass = new LatticePass(new Texture());
    /** the basis of each record, -1: its nodes are there */
    const draw = (lattices: (MovedLattice | null)[], unseen = -1) => {
      pass.begin(lattices, 2048, sum);
      return lattices.map((_, number) => (number === unseen ? null : pass.add(number, 0)?.basis));
    };
    const basis = sum === "gpu" ? 1 : 0;
    const [one, two] = [moved(hair, [0.1, 0.2]), moved(hair, [0.3])];
    expect(draw([one, two, nodes])).toEqual([basis, basis, 0]);
    expect(draw([one, two, nodes])).toEqual([-1, -1, 0]);
    one.show(Float32Array.of(0.1, 0.2, 0, 0)); // the same
    two.show(Float32Array.of(0.3, 0.1));
    expect(draw([one, two, nodes])).toEqual([-1, basis, 0]);
    two.show(Float32Array.of(0.3));
    expect(draw([one, two, nodes], 1)).toEqual([-1, null, 0]);
    expect(draw([one, two, nodes])).toEqual([-1, basis, 0]);
    expect(draw([one, nodes, two])).toEqual([-1, 0, basis]); // rows of others
    pass.forget();
    expect(draw([one, nodes, two])).toEqual([basis, 0, basis]);
    const other = moved(someBasis(6), [0.1, 0.2]);
    expect(draw([other, nodes, two])).toEqual([basis, 0, -1]);
  });

  test("are lost when the texture grows", () => {
    const pass = new LatticePass(new Texture());
    const one = moved(hair, [0.1]);
    for (const [lattices, expected] of [
      [[one], 1],
      [[one], -1],
      [[one, moved(large, [0.2])], 1],
      [[one, moved(large, [0.2])], -1],
    ] as const) {
      pass.begin(lattices, 2048);
      expect(pass.add(0, 0)?.basis).toBe(expected);
    }
  });
});

test("software that plays a GPU leaves the sum of nodes to the processor", () => {
  for (const software of [
    "llvmpipe (LLVM 15.0.6, 256 bits)",
    "llvmpipe, or similar",
    "softpipe",
    "Google SwiftShader",
    "ANGLE (Google, Vulkan 1.3.0 (SwiftShader Device (Subzero) (0x0000C0DE)), SwiftShader driver)",
    "ANGLE (Microsoft, Microsoft Basic Render Driver Direct3D11 vs_5_0 ps_5_0, D3D11)",
    "Apple Software Renderer",
  ])
    expect(nodeSumFor(software)).toBe("processor");
  for (const gpu of ["ANGLE (NVIDIA, NVIDIA GeForce RTX 3060)", "Apple GPU", "Mali-G78", "WebKit WebGL", ""])
    expect(nodeSumFor(gpu)).toBe("gpu");
});
