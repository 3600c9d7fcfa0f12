import { validateGeometry, type LevelGeometry } from "../hair/lattice";
import type * as fb from "./generated/messages";
import { vectorOf } from "./messageCodec";

/** Reads a table with the fields of `LevelGeometry`. Throws `HairnetError` unless it is valid. */
export function readGeometry(from: fb.LevelRecord | fb.HairBasis): LevelGeometry {
  const geometry = {
    lattice: {
      origin: new Float32Array(vectorOf(from.origin()!)),
      spacing: new Float32Array(vectorOf(from.spacing()!)),
      dims: [from.nodeCountX(), from.nodeCountY(), from.nodeCountZ()] as const,
    },
    activeNodes: from.activeNodesArray()!.slice(),
    trimmedNodes: from.trimmedNodesArray()!.slice(),
    trimmedBegin: from.trimmedBeginArray()!.slice(),
    trimmedFrom: from.trimmedFromArray()!.slice(),
    trimmedWeights: from.trimmedWeightsArray()!.slice(),
  };
  validateGeometry(geometry);
  return geometry;
}
