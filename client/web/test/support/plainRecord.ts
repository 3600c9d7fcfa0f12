import { Box3, Color, Vector3 } from "three";
import { rigidPose } from "../../src/hair/pose";
import type { CharacterRecord } from "../../src/scene/records";

/** The record of a black character at the origin, at rest, with all its strands. A test changes what it is about. */
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
    // Boxes of about the size of a head with long hair, and of the roots on it, head space, m.
    strandBox: new Box3(new Vector3(-0.3, -0.4, -0.3), new Vector3(0.3, 0.2, 0.3)),
    rootBox: new Box3(new Vector3(-0.1, 0.1, -0.1), new Vector3(0.1, 0.2, 0.1)),
  },
  // No strand is left out or simplified.
  detail: { strandShare: 1, followHairCount: 0, toleranceM: 0, quadratic: 1 },
  firstRow: 0,
  rowCount: 0,
  hasLight: false,
  id: 0,
  ballRadiusM: 0.45,
};
