import { Bone, kNumbersPerBone, rigidPose, type Pose } from "../../src/index";

export interface HeadAngles {
  /** The turn about +Y: positive looks to the head's left. */
  yawRad: number;
  /** The nod: positive looks down. */
  pitchRad: number;
  /** The tilt about the axis out of the face. */
  rollRad: number;
}

/** The middle of a head is about this far above its joint, as in `head_middle` of client/viewer/drawing/framing.cpp. */
export const kHeadMiddleM = 0.08;

type Vector = readonly [number, number, number];
type Quaternion = readonly [number, number, number, number];

/** The joint of the neck, head space at rest, m; for a groom with unknown joints. */
const kNeck: Vector = [0, -0.1, -0.02];
/** The angle of the head's yaw beyond which the trunk follows. */
const kTrunkFollowsBeyondRad = 0.6;

/**
 * Makes a whole pose from a head alone. `position`: of the head joint; `bodyYawRad`: direction of the trunk. Shoulders
 * and trunk stay upright below the neck, and the neck takes half of the head's turn.
 */
export function poseOf(rotation: Quaternion, position: Vector, bodyYawRad: number): Pose {
  const pose = rigidPose(rotation, position);
  const trunk = about([0, 1, 0], bodyYawRad);
  // The neck's joint hangs on the head; the trunk hangs on this joint.
  const neckWorld = add(rotate(rotation, kNeck), position);
  const neck = halfWay(trunk, rotation);
  putBone(pose, Bone.neck, neck, neckWorld, kNeck);
  for (const bone of [Bone.leftShoulder, Bone.rightShoulder, Bone.upperTrunk])
    putBone(pose, bone, trunk, neckWorld, kNeck);
  return pose;
}

/** The trunk's direction for a head's: it stays until the head is turned by more than kTrunkFollowsBeyondRad. */
export function followYaw(bodyYawRad: number, headYawRad: number): number {
  const away = Math.atan2(Math.sin(headYawRad - bodyYawRad), Math.cos(headYawRad - bodyYawRad));
  const beyond = Math.abs(away) - kTrunkFollowsBeyondRad;
  return beyond > 0 ? bodyYawRad + Math.sign(away) * beyond : bodyYawRad;
}

/** Yaw, then pitch, then roll. */
export function rotationOf(angles: HeadAngles): Quaternion {
  const yaw = about([0, 1, 0], angles.yawRad);
  const pitch = about([1, 0, 0], angles.pitchRad);
  return multiply(multiply(yaw, pitch), about([0, 0, 1], angles.rollRad));
}

/** The direction of a rotation's +Z, about +Y. */
export function yawOf(rotation: Quaternion): number {
  const [x, , z] = rotate(rotation, [0, 0, 1]);
  return Math.atan2(x, z);
}

/** Puts a bone that turns about a joint; the joint is given in the world and at rest. */
function putBone(pose: Pose, bone: Bone, rotation: Quaternion, jointWorld: Vector, jointRest: Vector): void {
  const turned = rotate(rotation, jointRest);
  const position = jointWorld.map((x, axis) => x - turned[axis]);
  pose.set([...rotation, ...position], bone * kNumbersPerBone);
}

function about(axis: Vector, angleRad: number): Quaternion {
  const s = Math.sin(angleRad / 2);
  return [axis[0] * s, axis[1] * s, axis[2] * s, Math.cos(angleRad / 2)];
}

function multiply(a: Quaternion, b: Quaternion): Quaternion {
  return [
    a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
    a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
    a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
    a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
  ];
}

function rotate(q: Quaternion, v: Vector): Vector {
  const [x, y, z] = multiply(multiply(q, [v[0], v[1], v[2], 0]), [-q[0], -q[1], -q[2], q[3]]);
  return [x, y, z];
}

function add(a: Vector, b: Vector): Vector {
  return [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
}

/** The rotation in the middle between two. */
function halfWay(a: Quaternion, b: Quaternion): Quaternion {
  const sign = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] < 0 ? -1 : 1;
  const sum = a.map((x, i) => x + sign * b[i]);
  const length = Math.hypot(...sum);
  return [sum[0] / length, sum[1] / length, sum[2] / length, sum[3] / length];
}
