import type { LevelGeometry } from "../../src/hair/lattice";

/** A level's geometry in the vectors. */
export interface GeometryVector {
  lattice: { origin: number[]; spacing: number[]; dims: [number, number, number] };
  activeNodes: number[];
  trimmedNodes: number[];
  trimmedBegin: number[];
  trimmedFrom: number[];
  trimmedWeights: number[];
}

export function geometryOf(vector: GeometryVector): LevelGeometry {
  return {
    lattice: {
      origin: Float32Array.from(vector.lattice.origin),
      spacing: Float32Array.from(vector.lattice.spacing),
      dims: vector.lattice.dims,
    },
    activeNodes: Uint32Array.from(vector.activeNodes),
    trimmedNodes: Uint32Array.from(vector.trimmedNodes),
    trimmedBegin: Uint32Array.from(vector.trimmedBegin),
    trimmedFrom: Uint32Array.from(vector.trimmedFrom),
    trimmedWeights: Float32Array.from(vector.trimmedWeights),
  };
}

/** All nodes of a grid active. */
export function fullGrid(dims: [number, number, number], spacingM = 0.1): LevelGeometry {
  const count = dims[0] * dims[1] * dims[2];
  return {
    lattice: { origin: new Float32Array(3), spacing: new Float32Array(3).fill(spacingM), dims },
    activeNodes: Uint32Array.from({ length: count }, (_, node) => node),
    trimmedNodes: new Uint32Array(0),
    trimmedBegin: new Uint32Array(1),
    trimmedFrom: new Uint32Array(0),
    trimmedWeights: new Float32Array(0),
  };
}
