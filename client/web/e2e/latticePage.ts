// The GPU's nodes beside those of the module, for latticePass.e2e.ts.
import { WebGLRenderer } from "three";
import { kLatticeRow } from "../src/generated/constants";
import { nodeCount, type MovedLattice } from "../src/hair/movedLattice";
import { connect, Role } from "../src/index";
import { startClient } from "../src/module/client";
import { LatticePass } from "../src/scene/latticePass";
import { nodeSumFor, rendererName, type NodeSum } from "../src/scene/nodeSum";
import { Records } from "../src/scene/records";
import { plainRecord } from "../test/support/plainRecord";
import { latticeOf } from "../test/support/shapes";

/** How far nodes on the GPU lie from those of the module, and how far those move, m. */
export interface Comparison {
  apartM: number;
  movedM: number;
  /**
   * The number of characters whose nodes are made again, in three pictures of the same state. The third picture has one
   * character less.
   */
  newCounts: number[];
  basisBytes: number;
  error: number;
}

/** Compares everyone in a room, once `heads` of them have hair of modes, and a lattice of the page's own. */
export async function compareNodes(server: string, room: string, heads: number, sum: NodeSum): Promise<Comparison> {
  const module = await startClient();
  const joined = await connect(server, { room, role: Role.observer });
  const waving = () => [...joined.members.values()].flatMap(({ lattice }) => (lattice?.modes ? [lattice] : []));
  // A displacement of 2 cm is far above rounding, and hair of a turning head soon has it.
  const isMoving = ({ grid }: MovedLattice) => Math.max(...grid.map(Math.abs)) > 0.02;
  while (waving().length < heads || !waving().every(isMoving)) {
    await new Promise((done) => setTimeout(done, 10));
    joined.sample(performance.now());
  }
  const renderer = new WebGLRenderer();
  const records = new Records();
  const pass = new LatticePass(records.texture);
  // The page's own lattice has 12 x 13 x 14 nodes of 3 numbers: 6552.
  const own = { lattice: latticeOf([12, 13, 14]), grid: Float32Array.from({ length: 6552 }, (_, i) => Math.sin(i)) };
  const all: MovedLattice[] = [own, ...waving()];
  const result: Comparison = { apartM: 0, movedM: 0, newCounts: [], basisBytes: 0, error: 0 };
  // The second picture finds its nodes in the texture. The third finds only the bases: its characters have other rows.
  for (const lattices of [all, all, all.slice(1)]) {
    const shown = lattices.map((lattice) => ({ lattice }));
    records.begin(module, shown);
    for (const n of shown.keys()) records.put(n, n, plainRecord);
    const data = records.write(sum, renderer.capabilities.maxTextureSize);
    result.newCounts.push(data.sources.reduce((count, { first, end }) => count + end - first, 0));
    pass.run(renderer, data);
    result.basisBytes = pass.basisBytes;
    let row = 0;
    for (const { grid, lattice } of lattices) {
      const read = pass.read(renderer, row, nodeCount(lattice));
      row += Math.ceil(nodeCount(lattice) / kLatticeRow);
      for (let i = 0; i < grid.length; ++i) {
        result.apartM = Math.max(result.apartM, Math.abs(read[4 * Math.floor(i / 3) + (i % 3)] - grid[i]));
        if (grid !== own.grid) result.movedM = Math.max(result.movedM, Math.abs(grid[i]));
      }
    }
  }
  result.error = renderer.getContext().getError();
  for (const each of [pass, records, renderer]) each.dispose();
  joined.close();
  return result;
}

/** What draws here, and who sums up nodes for it. */
export async function chosenSum(): Promise<{ name: string; sum: NodeSum }> {
  const renderer = new WebGLRenderer();
  const name = rendererName(renderer);
  renderer.dispose();
  return { name, sum: nodeSumFor(await startClient(), name) };
}

Object.assign(window, { compareNodes, chosenSum });
