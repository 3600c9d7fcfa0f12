import { kPositionMaxM } from "../generated/limits";
import { HairnetError } from "./hairnetError";

export { kPositionMaxM };

/**
 * The bones of one character at one moment: 7 numbers a bone, rotation x y z w and position x y z (metres), of a rigid
 * transform from head space at rest to the world, x_world = rotation x + position. At rest all bones are equal.
 * Right-handed, +Y up, +Z out of the face.
 */
export type Pose = Float64Array;

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
 * Describes a fault of a pose in one line, or returns null: numbers finite, rotations of unit length, coordinates
 * within 10 km.
 */
export function poseFault(pose: ArrayLike<number>): string | null {
  if (typeof pose !== "object" || pose === null) return `a pose is ${kPoseNumbers} numbers, as rigidPose() makes them`;
  if (pose.length !== kPoseNumbers)
    return `pose has ${pose.length} numbers, not ${kPoseNumbers}; rigidPose() makes one`;
  for (let i = 0; i < kPoseNumbers; ++i) {
    if (!Number.isFinite(pose[i])) return "pose is not finite";
  }
  for (let at = 0; at < kPoseNumbers; at += kNumbersPerBone) {
    const length = Math.hypot(pose[at], pose[at + 1], pose[at + 2], pose[at + 3]);
    if (!(Math.abs(length - 1) <= kUnitTolerance)) return "a rotation of the pose is not of unit length";
    for (let axis = 4; axis < 7; ++axis) {
      if (!(Math.abs(pose[at + axis]) <= kPositionMaxM)) return "pose is too far away";
    }
  }
  return null;
}

/** Throws `HairnetError` unless the pose is valid. */
export function validatePose(pose: ArrayLike<number>): void {
  const fault = poseFault(pose);
  if (fault) throw new HairnetError("invalid", fault);
}

/** Linear in position, shortest-arc slerp in rotation, bone by bone; an s beyond [0, 1] goes on. `out` may be a or b. */
export function interpolatePose(a: Pose, b: Pose, s: number, out: Pose): Pose {
  for (let at = 0; at < kPoseNumbers; at += kNumbersPerBone) {
    slerp(a, b, at, s, out);
    for (let axis = at + 4; axis < at + 7; ++axis) out[axis] = a[axis] + s * (b[axis] - a[axis]);
  }
  return out;
}

/** Moves `pose` by a share of the way from one pose to another, bone by bone. */
export function movePose(pose: Pose, from: Pose, to: Pose, share: number, out: Pose): Pose {
  const turn = new Float64Array(4);
  const unturned = Float64Array.of(0, 0, 0, 1);
  for (let at = 0; at < kPoseNumbers; at += kNumbersPerBone) {
    const back = [-from[at], -from[at + 1], -from[at + 2], from[at + 3]];
    multiply(to.subarray(at, at + 4), back, turn);
    slerp(unturned, turn, 0, share, turn);
    multiply(turn, pose.subarray(at, at + 4), out.subarray(at, at + 4));
    for (let axis = at + 4; axis < at + 7; ++axis) out[axis] = pose[axis] + share * (to[axis] - from[axis]);
  }
  return out;
}

/** The turn b, then a; x y z w. */
function multiply(a: ArrayLike<number>, b: ArrayLike<number>, out: Float64Array): void {
  out.set([
    a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
    a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
    a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
    a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
  ]);
}

function slerp(a: Pose, b: Pose, at: number, s: number, out: Pose): void {
  const dot = a[at] * b[at] + a[at + 1] * b[at + 1] + a[at + 2] * b[at + 2] + a[at + 3] * b[at + 3];
  const cosine = Math.abs(dot);
  let ofA = 1 - s;
  let ofB = s;
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
  const scale = 1 / Math.hypot(x, y, z, w);
  out[at] = x * scale;
  out[at + 1] = y * scale;
  out[at + 2] = z * scale;
  out[at + 3] = w * scale;
}
