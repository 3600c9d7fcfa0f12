import { kPoseNumbers, type Pose } from "../../hair/pose";
import { BitReader } from "./bits";
import { decodeCoefficients, type CoefficientCode } from "./coefficientCode";
import { decodePose } from "./poseCode";

const reader = new BitReader();

/** One character's frame: its pose, and the coefficients of its groom's basis. */
export interface DecodedFrame {
  readonly pose: Pose;
  /** m, one a mode; those that are missing at the end are 0 */
  readonly coefficients: Float32Array;
}

/**
 * For any bytes: a frame, or null when the pose is incomplete or out of bounds, or when bytes are left over after all
 * coefficients. A frame refers to no other, and any prefix with the whole pose is a frame with fewer coefficients.
 * `code`: null when the groom's basis is not known; then only the pose is decoded.
 */
export function decodeFrame(bytes: Uint8Array, code: CoefficientCode | null): DecodedFrame | null {
  reader.reset(bytes);
  const pose = new Float64Array(kPoseNumbers);
  if (!decodePose(reader, pose) || reader.isBeyondEnd()) return null;
  const coefficients = new Float32Array(code ? code.modeCount : 0);
  if (code && decodeCoefficients(code, reader, coefficients) === code.modeCount && !reader.endsHere()) return null;
  return { pose, coefficients };
}
