import { Texture } from "three";
import { describe, expect, test } from "vitest";
import { kLatticeRow } from "../../src/generated/constants";
import { nodeCount, type Basis, type Lattice, type MovedLattice } from "../../src/hair/movedLattice";
import { LatticePass } from "../../src/scene/latticePass";
import { nodeSumFor } from "../../src/scene/nodeSum";
import { latticeOf } from "../support/shapes";

interface Hair {
  readonly lattice: Lattice;
  readonly basis: Basis;
}

/** Its modes are 0: here only their places count. */
function someHair(modeCount: number, dims: [number, number, number] = [3, 4, 5]): Hair {
  const lattice = latticeOf(dims);
  const rows = 4 * Math.ceil(modeCount / 4) * Math.ceil(nodeCount(lattice) / kLatticeRow);
  return { lattice, basis: { modeCount, texels: () => new Float32Array(4 * kLatticeRow * rows) } };
}

function moved({ lattice, basis }: Hair, coefficients: ArrayLike<number>): MovedLattice {
  const grid = Float32Array.from({ length: 3 * nodeCount(lattice) }, (_, i) => 0.5 * Math.sin(i));
  return { lattice, grid, modes: { basis, coefficients: Float32Array.from(coefficients) } };
}

describe("places of lattices", () => {
  const hair = someHair(6);
  const large = someHair(5, [11, 11, 11]);
  const nodes: MovedLattice = { lattice: hair.lattice, grid: new Float32Array(180).fill(0.5) };

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
    expect(pass.uploadedNodes.subarray(0, 3)).toEqual(lattice.grid.subarray(0, 3));
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
    let [one, two] = [moved(hair, [0.1, 0.2]), moved(hair, [0.3])];
    expect(draw([one, two, nodes])).toEqual([basis, basis, 0]);
    expect(draw([one, two, nodes])).toEqual([-1, -1, 0]);
    one = moved(hair, [0.1, 0.2, 0, 0]); // the same
    two = moved(hair, [0.3, 0.1]);
    expect(draw([one, two, nodes])).toEqual([-1, basis, 0]);
    two = moved(hair, [0.3]);
    expect(draw([one, two, nodes], 1)).toEqual([-1, null, 0]);
    expect(draw([one, two, nodes])).toEqual([-1, basis, 0]);
    expect(draw([one, nodes, two])).toEqual([-1, 0, basis]); // rows of others
    pass.forget();
    expect(draw([one, nodes, two])).toEqual([basis, 0, basis]);
    const other = moved(someHair(6), [0.1, 0.2]);
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
