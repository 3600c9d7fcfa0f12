// The GPU's nodes beside those of the CPU, for latticePass.e2e.ts.
import { WebGLRenderer } from "three";
import type { HairBasis } from "../src/hair/basis";
import { ModeLattice, type MovedLattice } from "../src/hair/movedLattice";
import { kLatticeRow } from "../src/generated/constants";
import { CharacterRecords } from "../src/scene/characterRecords";
import { LatticePass } from "../src/scene/latticePass";
import { nodeSumFor, rendererName, type NodeSum } from "../src/scene/nodeSum";
import { fullGrid } from "../test/support/shapes";

/** Numbers from 0 up to 1, the same for the same seed. */
function seeded(seed: number): () => number {
  let state = seed;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 32;
  };
}

/** Modes of any shape on a lattice of which every third node follows others. */
export function anyBasis(dims: [number, number, number], modeCount: number, seed: number): HairBasis {
  const random = seeded(seed);
  const { lattice, activeNodes } = fullGrid(dims);
  const trimmedNodes = activeNodes.filter((node) => node % 3 === 1);
  const active = activeNodes.filter((node) => node % 3 !== 1);
  const entries = 5 * trimmedNodes.length;
  const geometry = {
    lattice,
    activeNodes: active,
    trimmedNodes,
    trimmedBegin: Uint32Array.from({ length: trimmedNodes.length + 1 }, (_, n) => 5 * n),
    trimmedFrom: Uint32Array.from({ length: entries }, () => Math.floor(random() * active.length)),
    trimmedWeights: Float32Array.from({ length: entries }, () => 1.2 * (random() - 0.4)),
  };
  const basis = {
    nodeCount: active.length,
    deviationM: Float32Array.from({ length: modeCount }, (_, k) => 0.1 / (1 + k)),
    unit: Float32Array.from({ length: modeCount }, () => (3 + random()) / 32767),
    modes: Int16Array.from({ length: 3 * modeCount * active.length }, () => 65534 * (random() - 0.5)),
  };
  return { geometry, basis, skin: [] };
}

function movedBy(hair: HairBasis, count: number, seed: number): ModeLattice {
  const random = seeded(seed);
  const lattice = new ModeLattice(hair);
  lattice.show(hair.basis.deviationM.slice(0, count).map((each) => each * (2 * random() - 1)));
  return lattice;
}

/** How far the nodes of several characters lie from those of the CPU, m, and how far those move. */
export function compareNodes(sum: NodeSum): { apartM: number[]; movedM: number; newCounts: number[]; error: number } {
  const renderer = new WebGLRenderer();
  const [one, other] = [anyBasis([10, 10, 10], 256, 1), anyBasis([12, 13, 14], 31, 2)];
  const uploaded = { geometry: one.geometry, grid: movedBy(one, 5, 9).grid.slice() };
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
      records.add({
        pose: new Float64Array(35),
        hairAlbedo: [0, 0, 0],
        hairTipAlbedo: [0, 0, 0],
        roughness: 0,
        skinAlbedo: [0, 0, 0],
        widthM: 1,
        detail: { strandShare: 1, followHairCount: 0, toleranceM: 0, quadratic: 1, cards: 0 },
        strayM: 0,
        size: 1,
        bodyVisible: true,
        lattice: placed,
        pointRows: { first: 0, count: 0 },
      });
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
