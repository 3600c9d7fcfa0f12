// The GPU's nodes beside those of the CPU, for latticePass.e2e.ts.
import { WebGLRenderer } from "three";
import { nodeCount, type Basis, type Lattice, type MovedLattice } from "../src/hair/movedLattice";
import { kLatticeRow } from "../src/generated/constants";
import { CharacterRecords } from "../src/scene/characterRecords";
import { LatticePass } from "../src/scene/latticePass";
import { nodeSumFor, rendererName, type NodeSum } from "../src/scene/nodeSum";
import { plainRecord } from "../test/support/plainRecord";
import { latticeOf } from "../test/support/shapes";

/** Numbers from 0 up to 1, the same for the same seed. */
function seeded(seed: number): () => number {
  let state = seed;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 32;
  };
}

interface Hair {
  readonly lattice: Lattice;
  readonly basis: Basis;
}

/** Modes of any shape; later ones are smaller. */
function anyHair(dims: [number, number, number], modeCount: number, seed: number): Hair {
  const random = seeded(seed);
  const lattice = latticeOf(dims);
  const rows = Math.ceil(nodeCount(lattice) / kLatticeRow);
  const texels = new Float32Array(4 * kLatticeRow * rows * 4 * Math.ceil(modeCount / 4));
  for (let mode = 0; mode < modeCount; ++mode)
    for (let i = 0; i < 4 * nodeCount(lattice); ++i)
      if (i % 4 < 3) texels[4 * kLatticeRow * rows * mode + i] = (6 * (random() - 0.5)) / (1 + mode);
  return { lattice, basis: { modeCount, texels: () => texels } };
}

/** By the first `count` of its modes. */
function movedBy({ lattice, basis }: Hair, count: number, seed: number): MovedLattice {
  const random = seeded(seed);
  const coefficients = Float32Array.from({ length: count }, () => 0.2 * (random() - 0.5));
  const texels = basis.texels();
  const mode = 4 * kLatticeRow * Math.ceil(nodeCount(lattice) / kLatticeRow);
  const grid = Float32Array.from({ length: 3 * nodeCount(lattice) }, (_, i) =>
    coefficients.reduce((sum, c, k) => sum + c * texels[mode * k + 4 * Math.floor(i / 3) + (i % 3)], 0),
  );
  return { lattice, grid, modes: { basis, coefficients } };
}

/** How far the nodes of several characters lie from those of the CPU, m, and how far those move. */
export function compareNodes(sum: NodeSum): { apartM: number[]; movedM: number; newCounts: number[]; error: number } {
  const renderer = new WebGLRenderer();
  const [one, other] = [anyHair([10, 10, 10], 256, 1), anyHair([12, 13, 14], 31, 2)];
  const uploaded = { lattice: one.lattice, grid: movedBy(one, 5, 9).grid };
  const lattices: MovedLattice[] = [
    movedBy(one, 256, 3),
    movedBy(other, 31, 4),
    uploaded,
    movedBy(one, 6, 5),
    movedBy(other, 0, 6),
    movedBy(one, 255, 7),
  ];
  const records = new CharacterRecords();
  const pass = new LatticePass(records.texture);
  const apartM: number[] = [];
  const newCounts: number[] = [];
  let movedM = 0;
  // The second picture finds nodes there, the third bases alone: it has other characters in other places.
  const reversed = [...lattices].reverse().slice(1);
  for (const shown of [lattices, lattices, reversed]) {
    pass.begin(shown, renderer.capabilities.maxTextureSize, sum);
    records.begin(shown.length);
    let newCount = 0;
    const places = shown.map((_, number) => {
      const placed = pass.add(number, records.count);
      if (placed!.basis >= 0) ++newCount;
      records.add({ ...plainRecord, lattice: placed });
      return placed!.firstNode / kLatticeRow;
    });
    records.end();
    newCounts.push(newCount);
    pass.run(renderer);
    for (const [n, { grid }] of shown.entries()) {
      const read = pass.read(renderer, places[n], grid.length / 3);
      let apart = 0;
      for (let i = 0; i < grid.length; ++i) {
        apart = Math.max(apart, Math.abs(read[4 * Math.floor(i / 3) + (i % 3)] - grid[i]));
        movedM = Math.max(movedM, Math.abs(grid[i]));
      }
      apartM.push(apart);
    }
  }
  const error = renderer.getContext().getError();
  pass.dispose();
  records.dispose();
  renderer.dispose();
  return { apartM, movedM, newCounts, error };
}

/** What draws here, and who sums up nodes for it. */
export function chosenSum(): { name: string; sum: NodeSum } {
  const renderer = new WebGLRenderer();
  const name = rendererName(renderer);
  renderer.dispose();
  return { name, sum: nodeSumFor(name) };
}

Object.assign(window, { compareNodes, chosenSum });
