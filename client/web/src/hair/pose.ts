import { kPositionMaxM } from "../generated/constants";
import { HairnetError } from "../module/hairnetError";

/**
 * The bones of one character at one moment: 7 numbers a bone, rotation x y z w and position x y z (metres), of a rigid
 * transform from head space at rest to the world, x_world = rotation x + position. At rest all bones are equal.
 * Right-handed, +Y up, +Z out of the face.
 */
export type Pose = Float64Array;

/** Count and order of the bones are those of core/pose/pose.hpp (`kBoneCount`, `Bone`). */
export const kBoneCount = 5;
export const kNumbersPerBone = 7;
export const kPoseNumbers = kBoneCount * kNumbersPerBone;

/** The index of each bone in a pose. */
export enum Bone {
  head = 0,
  neck = 1,
  leftShoulder = 2,
  rightShoulder = 3,
  upperTrunk = 4,
}

/** The length of a rotation may differ from 1 by this much, as in schema/wire/pose.cpp: servers refuse other poses. */
const kUnitTolerance = 1e-3;

/** All bones at one transform: the character at rest, moved as a whole. */
export function rigidPose(rotation: ArrayLike<number> = [0, 0, 0, 1], position: ArrayLike<number> = [0, 0, 0]): Pose {
  const pose = new Float64Array(kPoseNumbers);
  for (let bone = 0; bone < kBoneCount; ++bone) {
    pose.set(rotation, bone * kNumbersPerBone);
    pose.set(position, bone * kNumbersPerBone + 4);
  }
  return pose;
}

/**
 * Describes an error of a pose in one line, or returns null: numbers finite, rotations of unit length, coordinates
 * within 10 km.
 */
export function poseError(pose: ArrayLike<number>): string | null {
  return poseFormError(pose) ?? poseNumberError(pose);
}

/** The error of a value that is no pose at all: not a list of kPoseNumbers numbers. Null: it is one. */
export function poseFormError(pose: ArrayLike<number>): string | null {
  if (typeof pose !== "object" || pose === null) return `a pose is ${kPoseNumbers} numbers, as rigidPose() makes them`;
  if (pose.length === kPoseNumbers) return null;
  return `pose has ${pose.length} numbers, not ${kPoseNumbers}; rigidPose() makes one`;
}

/** The error of a pose's numbers, which a program may compute wrongly now and then. Null: they are right. */
export function poseNumberError(pose: ArrayLike<number>): string | null {
  for (let i = 0; i < kPoseNumbers; ++i) {
    if (!Number.isFinite(pose[i])) return "pose is not finite";
  }
  for (let at = 0; at < kPoseNumbers; at += kNumbersPerBone) {
    const length = Math.hypot(pose[at], pose[at + 1], pose[at + 2], pose[at + 3]);
    if (!(Math.abs(length - 1) <= kUnitTolerance)) return `a rotation of the pose has length ${length}, not 1`;
    for (let axis = 4; axis < 7; ++axis) {
      if (!(Math.abs(pose[at + axis]) <= kPositionMaxM))
        return `pose is too far away: ${pose[at + axis]} m along an axis, of at most ${kPositionMaxM} m`;
    }
  }
  return null;
}

/** Throws `HairnetError` unless the pose is valid. */
export function validatePose(pose: ArrayLike<number>): void {
  const error = poseError(pose);
  if (error) throw new HairnetError("invalid", error);
}

/**
 * The pose at the share s of the way from a to b, bone by bone: linear in position, slerp along the shorter arc in
 * rotation. An s below 0 or above 1 continues the motion. Writes to `out`, which may be a or b, and returns it.
 */
export function interpolatePose(a: Pose, b: Pose, s: number, out: Pose): Pose {
  for (let at = 0; at < kPoseNumbers; at += kNumbersPerBone) {
    slerp(a, b, at, s, out);
    for (let axis = at + 4; axis < at + 7; ++axis) out[axis] = a[axis] + s * (b[axis] - a[axis]);
  }
  return out;
}

function slerp(a: Pose, b: Pose, at: number, s: number, out: Pose): void {
  const dot = a[at] * b[at] + a[at + 1] * b[at + 1] + a[at + 2] * b[at + 2] + a[at + 3] * b[at + 3];
  const cosine = Math.abs(dot);
  let ofA = 1 - s;
  let ofB = s;
  // For equal rotations the sine is 0, and the weights of linear interpolation are right.
  if (cosine < 1 - Number.EPSILON) {
    const angle = Math.acos(cosine);
    const sine = Math.sin(angle);
    ofA = Math.sin((1 - s) * angle) / sine;
    ofB = Math.sin(s * angle) / sine;
  }
  if (dot < 0) ofB = -ofB;
  const x = ofA * a[at] + ofB * b[at];
  const y = ofA * a[at + 1] + ofB * b[at + 1];
  const z = ofA * a[at + 2] + ofB * b[at + 2];
  const w = ofA * a[at + 3] + ofB * b[at + 3];
  const scale = 1 / Math.sqrt(x * x + y * y + z * z + w * w);
  out[at] = x * scale;
  out[at + 1] = y * scale;
  out[at + 2] = z * scale;
  out[at + 3] = w * scale;
}
