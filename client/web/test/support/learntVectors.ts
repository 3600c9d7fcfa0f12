import { vectors } from "./vectors";

export interface LearntFrameVector {
  tick: number;
  pose: number[];
  isLearnt: boolean;
  evaluated: boolean;
  discontinuous: boolean;
  /** coefficients of the frame, and those that are shown */
  coded: number[];
  shown: number[];
}

export const learntVectors = vectors<{
  file: string;
  /** of all that the file holds */
  checksum: number;
  frames: LearntFrameVector[];
  /** checksum: null where C++ refuses the file */
  spoilt: { name: string; file: string; checksum: number | null }[];
}>("learnt.json");
