import type { Lattice } from "../../src/hair/movedLattice";

/** A lattice of `dims` nodes, `spacingM` apart on every axis, with its first node at `origin` (head space, m). */
export function latticeOf(
  dims: readonly [number, number, number],
  spacingM = 0.1,
  origin: readonly [number, number, number] = [0, 0, 0],
): Lattice {
  return { origin, spacing: [spacingM, spacingM, spacingM], dims };
}
