import type { Builder } from "flatbuffers";
import { kNumbersPerBone, kPoseNumbers, poseStep, rigidPose } from "../hair/pose";
import * as fb from "./generated/messages";
import type { PoseSample } from "./messages";

/** @internal */
export const kMoveStepM = 5e-5;
/** @internal */
export const kTurnStep = 1 / 32767;
// A larger turn would make it imprecise.
const kLeastW = 0.5;
const kShortMax = 32767;
const kU16Max = 65_535;
const kU32Max = 4_294_967_295;
// Of a bone: turn, then move.
const kShortsPerBone = 6;
const kShorts = (kPoseNumbers / kNumbersPerBone) * kShortsPerBone;
// Of a struct's bytes.
const kBonesAt = 10;
const step = rigidPose();

/** A pose that was sent before, as it differs from the first one of its character in the batch. */
export interface EarlierPose {
  readonly character: number;
  readonly capturedBeforeNs: number;
  /** at least 1 */
  readonly sequenceBefore: number;
  /** of each bone three of its turn, then three of its move */
  readonly shorts: Int16Array;
}

/** Null when it differs by more than fits: by 1.6 m, 120 degrees, 4 s, or 65535 of the sequence. */
export function toEarlier(earlier: PoseSample, later: PoseSample): EarlierPose | null {
  const capturedBeforeNs = Math.round(later.captureTimeNs) - Math.round(earlier.captureTimeNs);
  const sequenceBefore = (later.sequence - earlier.sequence) >>> 0;
  if (capturedBeforeNs < 0 || capturedBeforeNs > kU32Max || sequenceBefore === 0 || sequenceBefore > kU16Max)
    return null;
  poseStep(later.pose, earlier.pose, step);
  const shorts = new Int16Array(kShorts);
  for (let at = 0, to = 0; at < kPoseNumbers; at += kNumbersPerBone) {
    const w = step[at + 3];
    if (Math.abs(w) < kLeastW) return null;
    const turnStep = w < 0 ? -kTurnStep : kTurnStep;
    for (let c = 0; c < 3; ++c) shorts[to++] = Math.round(step[at + c] / turnStep);
    for (let c = 4; c < 7; ++c) {
      const move = Math.round(step[at + c] / kMoveStepM);
      if (Math.abs(move) > kShortMax) return null;
      shorts[to++] = move;
    }
  }
  return { character: later.character, capturedBeforeNs, sequenceBefore, shorts };
}

/** From its end, as builders write. */
export function writeEarlier(to: Builder, earlier: EarlierPose): void {
  to.prep(4, fb.EarlierPose.sizeOf());
  to.pad(fb.EarlierPose.sizeOf() - kBonesAt - 2 * kShorts);
  for (let i = kShorts - 1; i >= 0; --i) to.writeInt16(earlier.shorts[i]);
  to.writeInt16(earlier.sequenceBefore);
  to.writeInt32(earlier.character);
  to.writeInt32(earlier.capturedBeforeNs);
}

export function readEarlier(from: fb.EarlierPose): EarlierPose {
  return {
    character: from.character(),
    capturedBeforeNs: from.capturedBeforeNs(),
    sequenceBefore: from.sequenceBefore(),
    shorts: Int16Array.from({ length: kShorts }, (_, i) => from.bb!.readInt16(from.bb_pos + kBonesAt + 2 * i)),
  };
}
