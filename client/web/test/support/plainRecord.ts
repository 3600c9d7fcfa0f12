import { rigidPose } from "../../src/hair/pose";
import type { CharacterRecord } from "../../src/scene/characterRecords";

/** A character at rest at the origin: all its strands. */
export const plainRecord: CharacterRecord = {
  pose: rigidPose(),
  hairAlbedo: [0, 0, 0],
  hairTipAlbedo: [0, 0, 0],
  roughness: 0,
  skinAlbedo: [0, 0, 0],
  widthM: 1,
  detail: { strandShare: 1, followHairCount: 0, toleranceM: 0, quadratic: 1 },
  strayM: 0,
  size: 1,
  bodyVisible: true,
  lattice: null,
  pointRows: { first: 0, count: 0 },
};
