import { kLatticeRow } from "../generated/constants";
import type { Basis } from "../hair/basis";
import { expandDisplacements, nodeCount, type LevelGeometry } from "../hair/lattice";

/** Rows of kLatticeRow texels for the nodes of a grid. */
export function nodeRows(geometry: LevelGeometry): number {
  return Math.ceil(nodeCount(geometry.lattice) / kLatticeRow);
}

/** Rows of the texels of a basis: mode_nodes.frag reads four modes at once. */
export function modeRows(geometry: LevelGeometry, basis: Basis): number {
  return 4 * Math.ceil(basis.unit.length / 4) * nodeRows(geometry);
}

/**
 * The modes of a basis as mode_nodes.frag reads them: for each mode the rows of all grid nodes, with those that follow
 * active nodes worked out, so that their entries are not read again for each character. Equals
 * client/draw/mode_texels.cpp.
 */
export function modeTexels(geometry: LevelGeometry, basis: Basis): Float32Array<ArrayBuffer> {
  const numbers = 3 * basis.nodeCount;
  const row = 4 * kLatticeRow * nodeRows(geometry);
  const active = new Float32Array(numbers);
  const grid = new Float32Array(3 * nodeCount(geometry.lattice));
  const texels = new Float32Array(4 * kLatticeRow * modeRows(geometry, basis));
  basis.unit.forEach((unit, mode) => {
    for (let i = 0; i < numbers; ++i) active[i] = unit * basis.modes[numbers * mode + i];
    expandDisplacements(geometry, active, grid);
    for (let node = 0; node < grid.length / 3; ++node)
      texels.set(grid.subarray(3 * node, 3 * node + 3), row * mode + 4 * node);
  });
  return texels;
}
