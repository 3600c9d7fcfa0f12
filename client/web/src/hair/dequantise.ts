import type { ErrorClass } from "./level";
import { kStepsM, kVelocityStepsPerS } from "./level";
import type { Pose } from "./pose";
import { kBoneCount, kNumbersPerBone } from "./pose";

// Converts the integers of frames to metres (schema/codec/README.md, Integers).

/** A bone's position x y z and quaternion x y z w. */
const kIntegersPerBone = 7;
const kPositionStepM = 2 ** -14;

/** The pose for steps and frames: each number is rounded to float. Four zeros mean no rotation. */
export function dequantisePose(bones: Int32Array, out: Pose): Pose {
  for (let bone = 0; bone < kBoneCount; ++bone) {
    const from = kIntegersPerBone * bone;
    const to = kNumbersPerBone * bone;
    const x = bones[from + 3];
    const y = bones[from + 4];
    const z = bones[from + 5];
    const w = bones[from + 6];
    const length = Math.sqrt(x * x + y * y + z * z + w * w);
    const turned = length > 0;
    out[to] = turned ? Math.fround(x / length) : 0;
    out[to + 1] = turned ? Math.fround(y / length) : 0;
    out[to + 2] = turned ? Math.fround(z / length) : 0;
    out[to + 3] = turned ? Math.fround(w / length) : 1;
    for (let axis = 0; axis < 3; ++axis) out[to + 4 + axis] = Math.fround(bones[from + axis] * kPositionStepM);
  }
  return out;
}

/** Displacements, m; `out` has as many numbers as `nodes`. */
export function dequantiseNodes(nodes: Int16Array, errorClass: ErrorClass, out: Float32Array): void {
  const step = kStepsM[errorClass];
  for (let i = 0; i < nodes.length; ++i) out[i] = step * nodes[i];
}

/** Velocities, m/s; `out` has as many numbers as `velocities`. */
export function dequantiseVelocities(velocities: Int16Array, errorClass: ErrorClass, out: Float32Array): void {
  const unit = kVelocityStepsPerS * kStepsM[errorClass];
  for (let i = 0; i < velocities.length; ++i) out[i] = unit * velocities[i];
}
