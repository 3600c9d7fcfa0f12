import type { Instance } from "../module/instance";

/**
 * A regular grid of nodes in head space. Node (i, j, k) has index i + nx (j + ny k) and lies at
 * origin + (i dx, j dy, k dz).
 */
export interface Lattice {
  /** The place of node (0, 0, 0), m. */
  readonly origin: ArrayLike<number>;
  /** The distance of neighbouring nodes on each axis, m; each is above 0. */
  readonly spacing: ArrayLike<number>;
  /** The count of nodes on each axis, 2 to 64. */
  readonly dims: readonly [number, number, number];
}

/** The modes whose weighted sum gives the nodes' displacements: one object for all characters of a groom. */
export interface Basis {
  readonly modeCount: number;
  /**
   * For each mode, the displacements of all nodes for a coefficient of 1 m: x y z 0, in whole rows of 1024 nodes. Modes
   * of zeros follow until their count is a multiple of four (client/shaders/mode_nodes.frag).
   */
  texels(): Float32Array<ArrayBuffer>;
}

/** A lattice and how its nodes are displaced now. */
export interface MovedLattice {
  readonly lattice: Lattice;
  /** The displacements of the nodes, 3 numbers each, head space, m. They are computed when a caller reads them. */
  readonly grid: Float32Array;
  /** The modes of which `grid` is the sum, for members of a room; absent: `grid` is no such sum. */
  readonly modes?: MovedModes;
  /** @internal Where the module has this lattice, for the GPU to compute its nodes. Absent: it is a program's own. */
  readonly shown?: ShownLattice;
}

/** @internal */
export interface ShownLattice {
  readonly module: Instance;
  /** A hairnet_scene, and the index of one of its characters, as of the last `sample`. */
  readonly scene: number;
  readonly index: number;
}

/** How strongly each mode of a basis takes part. */
export interface MovedModes {
  readonly basis: Basis;
  /** A coefficient for each mode, m. Those that are missing at the end are 0. */
  readonly coefficients: Float32Array;
}

export function nodeCount({ dims }: Lattice): number {
  return dims[0] * dims[1] * dims[2];
}
