import { kLatticeCoordinateMaxM, kLatticeNodesPerAxisMax } from "../generated/limits";
import { HairnetError } from "./hairnetError";

/**
 * A regular grid of nodes in head space. Node (i, j, k) has grid index i + nx (j + ny k) and lies at
 * origin + (i dx, j dy, k dz).
 */
export interface Lattice {
  /** m */
  readonly origin: Float32Array;
  /** m, each above 0 */
  readonly spacing: Float32Array;
  /** nodes an axis, 2 to 64; quadratic FFD needs 3 */
  readonly dims: readonly [number, number, number];
}

/**
 * The static record of a level: the simulated grid nodes, and how the other nodes follow them. All data of simulated
 * nodes is in the order of `activeNodes`; an "active index" is an index into that list. Immutable.
 */
export interface LevelGeometry {
  readonly lattice: Lattice;
  /** grid indices, ascending */
  readonly activeNodes: Uint32Array;
  /** grid indices, ascending; with the active nodes they are the whole grid */
  readonly trimmedNodes: Uint32Array;
  /** trimmed node t combines entries [trimmedBegin[t], trimmedBegin[t + 1]) */
  readonly trimmedBegin: Uint32Array;
  /** active index */
  readonly trimmedFrom: Uint32Array;
  readonly trimmedWeights: Float32Array;
}

const kTrimmedWeightMax = 16;

export function nodeCount(lattice: Lattice): number {
  return lattice.dims[0] * lattice.dims[1] * lattice.dims[2];
}

/** Rest position of a grid node, head space, m. */
export function nodePosition(lattice: Lattice, node: number, out: Float32Array | Float64Array): void {
  const [nx, ny] = lattice.dims;
  const { origin, spacing } = lattice;
  out[0] = origin[0] + (node % nx) * spacing[0];
  out[1] = origin[1] + (Math.floor(node / nx) % ny) * spacing[1];
  out[2] = origin[2] + Math.floor(node / (nx * ny)) * spacing[2];
}

/**
 * Computes displacements (3 a node, head space, m) of every grid node, in index order, from those of the active nodes.
 * `gridOut` has 3 numbers for each grid node.
 */
export function expandDisplacements(geometry: LevelGeometry, active: ArrayLike<number>, gridOut: Float32Array): void {
  const { activeNodes, trimmedNodes, trimmedBegin, trimmedFrom, trimmedWeights } = geometry;
  for (let a = 0; a < activeNodes.length; ++a) {
    const node = 3 * activeNodes[a];
    gridOut[node] = active[3 * a];
    gridOut[node + 1] = active[3 * a + 1];
    gridOut[node + 2] = active[3 * a + 2];
  }
  for (let t = 0; t < trimmedNodes.length; ++t) {
    let x = 0;
    let y = 0;
    let z = 0;
    for (let e = trimmedBegin[t]; e < trimmedBegin[t + 1]; ++e) {
      const from = 3 * trimmedFrom[e];
      const weight = trimmedWeights[e];
      x += weight * active[from];
      y += weight * active[from + 1];
      z += weight * active[from + 2];
    }
    const node = 3 * trimmedNodes[t];
    gridOut[node] = x;
    gridOut[node + 1] = y;
    gridOut[node + 2] = z;
  }
}

/** Describes a fault of a level's geometry in one line, or returns null. */
export function geometryFault(geometry: LevelGeometry): string | null {
  return latticeFault(geometry.lattice) ?? partitionFault(geometry) ?? trimmedFault(geometry);
}

/** Throws `HairnetError` unless the geometry is valid. */
export function validateGeometry(geometry: LevelGeometry): void {
  const fault = geometryFault(geometry);
  if (fault) throw new HairnetError("invalid", fault);
}

function latticeFault(lattice: Lattice): string | null {
  for (const nodes of lattice.dims) {
    if (!(nodes >= 2 && nodes <= kLatticeNodesPerAxisMax)) return `lattice: ${nodes} nodes on an axis, not 2 to 64`;
  }
  for (let axis = 0; axis < 3; ++axis) {
    if (!(Math.abs(lattice.origin[axis]) <= kLatticeCoordinateMaxM))
      return "lattice: origin not finite or too far away";
    if (!(lattice.spacing[axis] > 0 && lattice.spacing[axis] <= kLatticeCoordinateMaxM))
      return "lattice: spacing not finite, not above 0 or too large";
  }
  return null;
}

/** The two lists are ascending, and each grid node is in exactly one. */
function partitionFault(geometry: LevelGeometry): string | null {
  const { activeNodes, trimmedNodes } = geometry;
  const count = nodeCount(geometry.lattice);
  let a = 0;
  let t = 0;
  let sound = activeNodes.length + trimmedNodes.length === count;
  for (let node = 0; sound && node < count; ++node) {
    if (a < activeNodes.length && activeNodes[a] === node) ++a;
    else if (t < trimmedNodes.length && trimmedNodes[t] === node) ++t;
    else sound = false;
  }
  return sound ? null : "active and trimmed nodes are not the whole grid, each once and ascending";
}

function trimmedFault(geometry: LevelGeometry): string | null {
  const { activeNodes, trimmedNodes, trimmedBegin, trimmedFrom, trimmedWeights } = geometry;
  const agree =
    trimmedBegin.length === trimmedNodes.length + 1 &&
    trimmedBegin[0] === 0 &&
    trimmedBegin[trimmedNodes.length] === trimmedFrom.length &&
    trimmedWeights.length === trimmedFrom.length;
  if (!agree) return "trimmed nodes: counts disagree";
  for (let t = 0; t < trimmedNodes.length; ++t) {
    if (trimmedBegin[t] > trimmedBegin[t + 1]) return "trimmed nodes: offsets descend";
  }
  for (let e = 0; e < trimmedFrom.length; ++e) {
    if (trimmedFrom[e] >= activeNodes.length) return "trimmed nodes: an active node does not exist";
    if (!(Math.abs(trimmedWeights[e]) <= kTrimmedWeightMax)) return "trimmed nodes: a weight is not in [-16, 16]";
  }
  return null;
}
