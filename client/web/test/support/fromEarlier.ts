import { addPoseStep, kNumbersPerBone, kPoseNumbers, rigidPose } from "../../src/hair/pose";
import { kMoveStepM, kTurnStep, type EarlierPose } from "../../src/net/earlierPose";
import type { PoseSample } from "../../src/net/messages";

/** The pose itself, rounded, as servers work it out; `later` is the character's first pose of the batch. */
export function fromEarlier(earlier: EarlierPose, later: PoseSample): PoseSample {
  const step = rigidPose();
  for (let at = 0, from = 0; at < kPoseNumbers; at += kNumbersPerBone) {
    for (let c = 0; c < 3; ++c) step[at + c] = kTurnStep * earlier.shorts[from++];
    step[at + 3] = Math.sqrt(Math.max(1 - step[at] ** 2 - step[at + 1] ** 2 - step[at + 2] ** 2, 0));
    for (let c = 4; c < 7; ++c) step[at + c] = kMoveStepM * earlier.shorts[from++];
  }
  const pose = later.pose.slice();
  addPoseStep(pose, step, 1);
  return {
    character: later.character,
    sequence: (later.sequence - earlier.sequenceBefore) >>> 0,
    captureTimeNs: later.captureTimeNs - earlier.capturedBeforeNs,
    teleport: false,
    pose: Float64Array.from(pose, Math.fround),
  };
}
