import type { Instance } from "../module/instance";

/**
 * A regular grid of nodes in head space. Node (i, j, k) has index i + nx (j + ny k) and lies at
 * origin + (i dx, j dy, k dz).
 */
export interface Lattice {
  /** m */
  readonly origin: ArrayLike<number>;
  /** m, each above 0 */
  readonly spacing: ArrayLike<number>;
  /** nodes an axis, 2 to 64 */
  readonly dims: readonly [number, number, number];
}

/** What nodes are the sum of: the same object for all characters of a groom. */
export interface Basis {
  readonly modeCount: number;
  /**
   * For each mode, and for more of 0 until there are a multiple of four, the displacements of all nodes for a coefficient
   * of 1 m: x y z 0, in whole rows of 1024 (client/shaders/mode_nodes.frag).
   */
  texels(): Float32Array<ArrayBuffer>;
}

/** A lattice at one moment. */
export interface MovedLattice {
  readonly lattice: Lattice;
  /** displacements: 3 a node, head space, m. Computed when a caller wants them. */
  readonly grid: Float32Array;
  /** of which `grid` is the sum, of a room's member; absent: of none */
  readonly modes?: MovedModes;
  /** @internal Where the module has it: then the GPU computes it by itself. Absent: a program's own. */
  readonly shown?: ShownLattice;
}

/** @internal */
export interface ShownLattice {
  readonly module: Instance;
  /** a hairnet_scene, and the index of one of its characters, at the last `sample` */
  readonly scene: number;
  readonly index: number;
}

export interface MovedModes {
  readonly basis: Basis;
  /** m; those that are missing at the end are 0 */
  readonly coefficients: Float32Array;
}

export function nodeCount({ dims }: Lattice): number {
  return dims[0] * dims[1] * dims[2];
}
