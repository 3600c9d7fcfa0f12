import type { LevelGeometry } from "../../hair/lattice";

const kAxes = 3;

/**
 * Which nodes of a frame, coded earlier, a node is predicted from: 3 active indices a node, present ones first; an absent
 * one is the number of active nodes. Immutable.
 */
export class Neighbours {
  readonly nodeCount: number;
  readonly nodes: Uint32Array;
  /** of each node, how many there are */
  readonly counts: Uint8Array;

  constructor(geometry: LevelGeometry) {
    const { activeNodes, lattice } = geometry;
    const [nx, ny, nz] = lattice.dims;
    this.nodeCount = activeNodes.length;
    this.nodes = new Uint32Array(kAxes * this.nodeCount).fill(this.nodeCount);
    this.counts = new Uint8Array(this.nodeCount);
    const activeIndex = new Int32Array(nx * ny * nz).fill(-1);
    for (let index = 0; index < this.nodeCount; ++index) activeIndex[activeNodes[index]] = index;
    for (let index = 0; index < this.nodeCount; ++index) {
      const node = activeNodes[index];
      const i = node % nx;
      const j = Math.floor(node / nx) % ny;
      const k = Math.floor(node / (nx * ny));
      if (i + 1 < nx) this.#add(index, activeIndex[node + 1]);
      if (j + 1 < ny) this.#add(index, activeIndex[node + nx]);
      if (k + 1 < nz) this.#add(index, activeIndex[node + nx * ny]);
    }
  }

  #add(index: number, neighbour: number): void {
    if (neighbour >= 0) this.nodes[kAxes * index + this.counts[index]++] = neighbour;
  }
}
