import * as flatbuffers from "flatbuffers";
import { validateBasis, type Basis } from "../hair/basis";
import type { LevelGeometry } from "../hair/lattice";
import { unfold16 } from "./codec/golomb";
import { layouts } from "./generated/layout";
import * as fb from "./generated/messages";
import { readGeometry } from "./geometryTable";
import { invalid } from "./messageCodec";
import { kPackedBasis, unpack } from "./packing";
import { verifyBuffer } from "./verify";

/** What a client needs to draw the hair of a groom from coefficients: the finest level's lattice and its modes. */
export interface HairBasis {
  readonly geometry: LevelGeometry;
  readonly basis: Basis;
}

/**
 * The basis of a file, checked all through: counts, ranges and that numbers are finite. Nothing of it lies in `file`.
 * Throws `HairnetError` and nothing else.
 */
export function decodeBasis(file: Uint8Array): HairBasis {
  const table = unpack(file, kPackedBasis);
  verifyBuffer(table, "HNBS", "HairBasis", layouts);
  const root = fb.HairBasis.getSizePrefixedRootAsHairBasis(new flatbuffers.ByteBuffer(table));
  const geometry = readGeometry(root);
  const nodeCount = geometry.activeNodes.length;
  const deviationM = root.deviationMArray()!.slice();
  const planes = root.modePlanesArray()!;
  if (planes.length !== 2 * 3 * nodeCount * deviationM.length)
    throw invalid("a basis whose modes have another number of nodes");
  const basis = { nodeCount, deviationM, unit: root.unitArray()!.slice(), modes: readPlanes(planes, nodeCount) };
  validateBasis(basis);
  return { geometry, basis };
}

/** Low bytes, then high bytes: mode by mode x of all nodes, y, z; each less the one before. */
function readPlanes(planes: Uint8Array, nodeCount: number): Int16Array {
  const count = planes.length / 2;
  const modes = new Int16Array(count);
  let at = 0;
  let before = 0;
  for (let mode = 0; mode < count; mode += 3 * nodeCount) {
    for (let axis = 0; axis < 3; ++axis) {
      for (let node = 0; node < nodeCount; ++node, ++at) {
        const i = mode + 3 * node + axis;
        modes[i] = before + unfold16(planes[at] | (planes[count + at] << 8));
        before = modes[i];
      }
    }
  }
  return modes;
}
