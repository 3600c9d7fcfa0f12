import { type Box3, Vector3 } from "three";
import { kCellsBeside, kDensityShare, kDensitySide } from "../generated/constants";
import type { MovedLattice } from "../hair/movedLattice";

/** Where a character's grid of density lies (client/shaders/density.glsl). Head space, m. */
export interface DensityGrid {
  readonly number: number;
  readonly origin: Vector3;
  readonly cell: Vector3;
  /** optical depth in a metre of a cell that contains a metre of strand */
  readonly weight: number;
}

/**
 * The box that contains the hair as the lattice moves it: `rest` contains the resting hair, `roots` what does not move.
 * Equals client/draw/density_grid.cpp.
 */
export function movedBox(rest: Box3, roots: Box3, lattice: MovedLattice | null): Box3 {
  if (!lattice) return rest;
  const { grid } = lattice;
  const { origin, spacing, dims } = lattice.lattice;
  const near = rest.clone().expandByVector(new Vector3(spacing[0], spacing[1], spacing[2]));
  const box = roots.clone();
  const at = new Vector3();
  for (let k = 0, n = 0; k < dims[2]; ++k)
    for (let j = 0; j < dims[1]; ++j)
      for (let i = 0; i < dims[0]; ++i, ++n) {
        at.set(origin[0] + i * spacing[0], origin[1] + j * spacing[1], origin[2] + k * spacing[2]);
        if (!near.containsPoint(at)) continue;
        at.clamp(rest.min, rest.max);
        at.x += grid[3 * n];
        at.y += grid[3 * n + 1];
        at.z += grid[3 * n + 2];
        if (Number.isFinite(at.x + at.y + at.z)) box.expandByPoint(at);
      }
  return box;
}

/** `widthM`: of all strands together that one counted strand represents. */
export function densityGrid(box: Box3, number: number, widthM: number): DensityGrid {
  const cell = box.getSize(new Vector3()).divideScalar(kDensitySide - 2 * kCellsBeside);
  const smallest = Math.max(Math.max(cell.x, cell.y, cell.z) / 3, 1e-3);
  cell.set(Math.max(cell.x, smallest), Math.max(cell.y, smallest), Math.max(cell.z, smallest));
  const origin = box.getCenter(new Vector3()).addScaledVector(cell, -0.5 * kDensitySide);
  return { number, origin, cell, weight: (kDensityShare * 0.75 * widthM) / (cell.x * cell.y * cell.z) };
}
