import { describe, expect, it } from "vitest";
import { basisFault, displacementsOf, type Basis, type HairBasis } from "../../src/hair/basis";
import { HairnetError } from "../../src/hair/hairnetError";
import { decodeBasis } from "../../src/net/basisFile";
import { geometryOf, type GeometryVector } from "../support/shapes";
import { fromHex, furthest, vectors } from "../support/vectors";

interface Vectors {
  file: string;
  /** of all that the file holds */
  checksum: number;
  geometry: GeometryVector;
  nodeCount: number;
  deviationM: number[];
  unit: number[];
  modes: number[];
  samples: { coefficients: number[]; displacements: number[] }[];
  /** checksum: null where C++ refuses the file */
  spoilt: { name: string; file: string; checksum: number | null }[];
}

const good = vectors<Vectors>("basis.json");

function attempt(file: Uint8Array): HairBasis | HairnetError {
  try {
    return decodeBasis(file);
  } catch (error) {
    if (!(error instanceof HairnetError)) throw error;
    expect(error.message).not.toMatch(/\n/);
    return error;
  }
}

/** Of integers, and of the bits of floats, as words of 32 bits. */
function checksumOf({ geometry, basis, skin }: HairBasis): number {
  const { lattice } = geometry;
  let sum = 0;
  const add = (numbers: Iterable<number>) => {
    for (const number of numbers) sum = Math.imul(sum ^ number, 16_777_619);
  };
  const addFloats = (numbers: Float32Array) => add(new Uint32Array(numbers.buffer, numbers.byteOffset, numbers.length));
  addFloats(lattice.origin);
  addFloats(lattice.spacing);
  add(lattice.dims);
  for (const list of [geometry.activeNodes, geometry.trimmedNodes, geometry.trimmedBegin, geometry.trimmedFrom])
    add(list);
  addFloats(geometry.trimmedWeights);
  addFloats(basis.deviationM);
  addFloats(basis.unit);
  add(basis.modes);
  for (const { bone, origin, cellM, dims, bytes } of skin) {
    add([bone]);
    addFloats(origin);
    addFloats(Float32Array.of(cellM));
    add(dims);
    add(bytes);
  }
  return sum >>> 0;
}

describe("basis files", () => {
  it("reads a basis as C++ does", () => {
    const got = decodeBasis(fromHex(good.file));
    expect(got.geometry).toEqual(geometryOf(good.geometry));
    expect(got.basis).toEqual({
      nodeCount: good.nodeCount,
      deviationM: Float32Array.from(good.deviationM),
      unit: Float32Array.from(good.unit),
      modes: Int16Array.from(good.modes),
    });
    expect(checksumOf(got)).toBe(good.checksum);
  });

  it("moves nodes as C++ does, bit for bit", () => {
    const { basis } = decodeBasis(fromHex(good.file));
    const out = new Float32Array(3 * basis.nodeCount).fill(NaN);
    for (const { coefficients, displacements } of good.samples) {
      displacementsOf(basis, Float32Array.from(coefficients), out);
      expect(furthest(out, displacements)).toBe(0);
    }
    expect(good.samples.map((each) => each.coefficients.length)).toEqual([0, 1, 2, 3, 4, 5]);
  });

  it("refuses the spoilt files that C++ refuses, and reads the others as C++ does", () => {
    for (const { name, file, checksum } of good.spoilt) {
      const got = attempt(fromHex(file));
      expect(got instanceof HairnetError ? null : checksumOf(got), name).toBe(checksum);
    }
    const refused = good.spoilt.filter((each) => each.checksum === null).length;
    expect(refused).toBeGreaterThan(good.spoilt.length / 4);
    expect(refused).toBeLessThan(good.spoilt.length);
  });

  it("keeps nothing of the file, wherever it lies in memory", () => {
    const bytes = fromHex(good.file);
    const moved = new Uint8Array(bytes.length + 3).subarray(3);
    moved.set(bytes);
    const got = decodeBasis(moved);
    moved.fill(0);
    expect(checksumOf(got)).toBe(good.checksum);
  });
});

describe("a basis", () => {
  const sound: Basis = {
    nodeCount: 1,
    deviationM: Float32Array.of(0.2, 0.2, 0.1),
    unit: Float32Array.of(1, 2, 3),
    modes: new Int16Array(9),
  };

  it.each([
    ["no nodes", { nodeCount: 0 }],
    ["more nodes than its modes have", { nodeCount: 2 }],
    ["more modes than allowed", { deviationM: new Float32Array(129).fill(1) }],
    ["ascending deviations", { deviationM: Float32Array.of(0.2, 0.1, 0.2) }],
    ["a unit of NaN", { unit: Float32Array.of(1, NaN, 1) }],
    ["a unit too few", { unit: Float32Array.of(1, 1) }],
  ])("with %s has a fault", (_, change) => {
    expect(basisFault(sound)).toBeNull();
    expect(basisFault({ ...sound, ...change })).toMatch(/^a basis/);
  });
});
