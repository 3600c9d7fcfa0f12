import { kSkinCellMinM, kSkinNodesMax, kSkinNumberMax } from "../generated/constants";
import { HairnetError } from "./hairnetError";
import { kBoneCount, type Bone } from "./pose";

/**
 * The skin that follows one bone: the signed distance to it (negative inside) on a grid, in head space at rest. A byte
 * is a distance of kSkinDeepestM and kSkinStepM for each 1; farther from the skin, the nearest that a byte says.
 */
export interface SkinDistanceField {
  readonly bone: Bone;
  /** of node (0, 0, 0), m */
  readonly origin: Float32Array;
  /** between two nodes */
  readonly cellM: number;
  /** nodes an axis, each at least 2 */
  readonly dims: readonly [number, number, number];
  /** node (i, j, k) has index i + nx (j + ny k) */
  readonly bytes: Uint8Array;
}

/** At most one field a bone. Immutable. */
export type Skin = readonly SkinDistanceField[];

/** Describes a fault of a skin in one line, or returns null. */
export function skinFault(skin: Skin): string | null {
  const met = new Set<Bone>();
  for (const { bone, origin, cellM, dims, bytes } of skin) {
    if (bone >= kBoneCount || met.has(bone)) return "skin: no such bone, or two fields of one";
    met.add(bone);
    if (!origin.every((x) => Math.abs(x) <= kSkinNumberMax)) return "skin: an origin is not finite";
    if (!(cellM >= Math.fround(kSkinCellMinM) && cellM <= kSkinNumberMax)) return "skin: a cell without size";
    if (!dims.every((nodes) => nodes >= 2 && nodes <= kSkinNodesMax)) return "skin: a grid of no or too many nodes";
    const count = dims[0] * dims[1] * dims[2];
    if (count > kSkinNodesMax || bytes.length !== count) return "skin: counts disagree";
  }
  return null;
}

/** Throws `HairnetError` unless the skin is valid. */
export function validateSkin(skin: Skin): void {
  const fault = skinFault(skin);
  if (fault) throw new HairnetError("invalid", fault);
}
