import { Box3, Color, Vector3 } from "three";
import { rigidPose } from "../../src/hair/pose";
import type { CharacterRecord } from "../../src/scene/records";

/** A character at the origin: all its strands. */
export const plainRecord: CharacterRecord = {
  pose: rigidPose(),
  size: 1,
  hair: new Color(0),
  hairTip: new Color(0),
  skin: new Color(0),
  roughness: 0,
  bodyVisible: true,
  strands: {
    strandCount: 1,
    strandWidthM: 1,
    strandBox: new Box3(new Vector3(-0.3, -0.4, -0.3), new Vector3(0.3, 0.2, 0.3)),
    rootBox: new Box3(new Vector3(-0.1, 0.1, -0.1), new Vector3(0.1, 0.2, 0.1)),
  },
  detail: { strandShare: 1, followHairCount: 0, toleranceM: 0, quadratic: 1 },
  firstRow: 0,
  rowCount: 0,
  hasLight: false,
  id: 0,
  ballRadiusM: 0.45,
};
