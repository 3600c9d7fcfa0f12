import * as flatbuffers from "flatbuffers";
import { validateBasis, type HairBasis } from "../hair/basis";
import { validateGeometry, type LevelGeometry } from "../hair/lattice";
import { validateSkin, type SkinDistanceField } from "../hair/skin";
import { unfold16 } from "./codec/golomb";
import { layouts } from "./generated/layout";
import * as fb from "./generated/messages";
import { invalid, vectorOf } from "./messageCodec";
import { kPackedBasis, unpack } from "./packing";
import { verifyBuffer } from "./verify";

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
  const skin: SkinDistanceField[] = [];
  for (let n = 0; n < root.skinLength(); ++n) skin.push(readSkin(root.skin(n)!));
  validateSkin(skin);
  return { geometry, basis, skin };
}

/** Each byte is what it says less what the nodes before it say (schema/basis.fbs). */
function readSkin(from: fb.BoneSkin): SkinDistanceField {
  const origin = from.origin()!;
  const dims = [from.nodeCountX(), from.nodeCountY(), from.nodeCountZ()] as const;
  const bytes = from.bytesArray()!.slice();
  if (bytes.length !== dims[0] * dims[1] * dims[2]) throw invalid("skin: counts disagree");
  const [nx, ny] = dims;
  const layer = nx * ny;
  for (let node = 0; node < bytes.length; ++node) {
    const x = node % nx > 0 ? 1 : 0;
    const y = Math.floor(node / nx) % ny > 0 ? nx : 0;
    const z = node >= layer ? layer : 0;
    const back = (steps: number, isThere: number) => (isThere ? bytes[node - steps] : 0);
    bytes[node] +=
      back(x, x) +
      back(y, y) +
      back(z, z) -
      back(x + y, x && y) -
      back(x + z, x && z) -
      back(y + z, y && z) +
      back(x + y + z, x && y && z);
  }
  return {
    bone: from.bone(),
    origin: Float32Array.of(origin.x(), origin.y(), origin.z()),
    cellM: from.cellM(),
    dims,
    bytes,
  };
}

function readGeometry(from: fb.HairBasis): LevelGeometry {
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
