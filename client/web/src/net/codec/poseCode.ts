import { Bone, kNumbersPerBone, kPoseNumbers, kPositionMaxM, type Pose } from "../../hair/pose";
import type { BitReader } from "./bits";
import { unfold32 } from "./golomb";

// The pose of a frame, each bone from those before it (schema/codec/README.md, Poses and coefficients). Sums have the
// order of the C++ ones, and numbers are rounded to float at the same places, so that both ends have the same bits.

/** x y z */
export type Vector = readonly [number, number, number];
/** x y z w, of unit length */
export type Rotation = readonly [number, number, number, number];
/** What x y z of a bone at a joint are expected to be, and the axes and steps of what is added. */
type Expected = { readonly point: Vector; readonly axes: Rotation; readonly stepM: number };

const kHeadPositionStepM = 2 ** -13;
const kBonePositionStepM = 2 ** -9;
const kBoneRotationStep = 2 ** -9;
const kPositionWidthBits = 5;
const kPositionWidthMax = 30;
const kRotationWidthBits = 4;
/** Instead of a width: any rotation follows. */
const kAnyRotation = 15;
const kRotationBits = 14;
const kAnyRotationStep = Math.sqrt(0.5) / (2 ** (kRotationBits - 1) - 1);
/** The index of w in a rotation. */
const kW = 3;

// Where bones meet in head space at rest, m.
const kHeadJoint: Vector = [0, 0, 0];
const kNeckJoint: Vector = [0, -0.1, -0.02];
const kLeftJoint: Vector = [0.03, -0.16, -0.01];
const kRightJoint: Vector = [-0.03, -0.16, -0.01];

const kNowhere: Vector = [0, 0, 0];
const kUnturned: Rotation = [0, 0, 0, 1];

/**
 * False when a position is out of the wire's bounds. For any bits `pose` is finite, with rotations of unit length; the
 * reader knows whether they were all there.
 */
export function decodePose(reader: BitReader, pose: Pose): boolean {
  const head = takePoint(reader, { point: kNowhere, axes: kUnturned, stepM: kHeadPositionStepM });
  const axes = setBone(pose, Bone.head, takeAnyRotation(reader), head, kHeadJoint);
  const trunk = takeTurn(reader, axes);
  const neck = takeTurn(reader, halfway(axes, trunk));
  const near = (point: Vector): Vector => takePoint(reader, { point, axes, stepM: kBonePositionStepM });
  setBone(pose, Bone.neck, neck, near(head), kHeadJoint);
  setBone(pose, Bone.upperTrunk, trunk, near(pointOf(pose, Bone.neck, kNeckJoint)), kNeckJoint);
  for (const [bone, joint] of [
    [Bone.leftShoulder, kLeftJoint],
    [Bone.rightShoulder, kRightJoint],
  ] as const) {
    const shoulder = takeTurn(reader, trunk);
    setBone(pose, bone, shoulder, near(pointOf(pose, Bone.upperTrunk, joint)), joint);
  }
  return isWithinBounds(pose);
}

function isWithinBounds(pose: Pose): boolean {
  for (let at = 0; at < kPoseNumbers; at += kNumbersPerBone) {
    for (let axis = at + 4; axis < at + kNumbersPerBone; ++axis) {
      if (!(Math.abs(pose[axis]) <= 2 * kPositionMaxM)) return false;
    }
  }
  return true;
}

/** Sets the bone that is at `point` with its `joint`, and returns its rotation as the pose has it. */
function setBone(pose: Pose, bone: Bone, rotation: Rotation, point: Vector, joint: Vector): Rotation {
  const q = rounded(rotation);
  const arm = turned(q, joint);
  const at = bone * kNumbersPerBone;
  pose.set(q, at);
  for (let axis = 0; axis < 3; ++axis) pose[at + 4 + axis] = Math.fround(point[axis] - arm[axis]);
  return q;
}

/** Where a bone has a joint. */
function pointOf(pose: Pose, bone: Bone, joint: Vector): Vector {
  const at = bone * kNumbersPerBone;
  const [x, y, z] = turned([pose[at], pose[at + 1], pose[at + 2], pose[at + 3]], joint);
  return [x + pose[at + 4], y + pose[at + 5], z + pose[at + 6]];
}

function takeIntegers(reader: BitReader, width: number, step: number): Vector {
  const x = step * unfold32(reader.take(width));
  const y = step * unfold32(reader.take(width));
  const z = step * unfold32(reader.take(width));
  return [x, y, z];
}

function takePoint(reader: BitReader, { point, axes, stepM }: Expected): Vector {
  const width = Math.min(reader.take(kPositionWidthBits), kPositionWidthMax);
  const [x, y, z] = turned(axes, takeIntegers(reader, width, stepM));
  return [point[0] + x, point[1] + y, point[2] + z];
}

function takeAnyRotation(reader: BitReader): Rotation {
  const largest = reader.take(2);
  return completed(largest, takeIntegers(reader, kRotationBits, kAnyRotationStep));
}

/** A rotation that is likely to be near `expected`. */
function takeTurn(reader: BitReader, expected: Rotation): Rotation {
  const width = reader.take(kRotationWidthBits);
  if (width === kAnyRotation) return product(expected, takeAnyRotation(reader));
  return product(expected, completed(kW, takeIntegers(reader, width, kBoneRotationStep)));
}

/** The rotation whose component `largest` is positive and follows from the three others. */
function completed(largest: number, others: Vector): Rotation {
  const [a, b, c] = others;
  const last = Math.sqrt(Math.max(1 - (a * a + b * b + c * c), 0));
  if (largest === 0) return normalised(last, a, b, c);
  if (largest === 1) return normalised(a, last, b, c);
  if (largest === 2) return normalised(a, b, last, c);
  return normalised(a, b, c, last);
}

function normalised(x: number, y: number, z: number, w: number): Rotation {
  const length = Math.sqrt(x * x + z * z + (y * y + w * w));
  return [x / length, y / length, z / length, w / length];
}

function rounded(q: Rotation): Rotation {
  const [x, y, z, w] = normalised(...q);
  return [Math.fround(x), Math.fround(y), Math.fround(z), Math.fround(w)];
}

/** Most necks take half of the head's turn. */
function halfway(a: Rotation, b: Rotation): Rotation {
  const dot = a[0] * b[0] + a[2] * b[2] + (a[1] * b[1] + a[3] * b[3]);
  const sign = dot < 0 ? -1 : 1;
  return normalised(a[0] + sign * b[0], a[1] + sign * b[1], a[2] + sign * b[2], a[3] + sign * b[3]);
}

function product(a: Rotation, b: Rotation): Rotation {
  const [ax, ay, az, aw] = a;
  const [bx, by, bz, bw] = b;
  return [
    aw * bx + ay * bz - (az * by - ax * bw),
    aw * by + ay * bw + (az * bx - ax * bz),
    aw * bz - ay * bx + (az * bw + ax * by),
    aw * bw - ay * by - (az * bz + ax * bx),
  ];
}

function cross(a: Vector | Rotation, b: Vector): Vector {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

/** `v` turned by `q`. */
export function turned(q: Rotation, v: Vector): Vector {
  const [x, y, z] = cross(q, v);
  const twice: Vector = [x + x, y + y, z + z];
  const last = cross(q, twice);
  const w = q[3];
  return [v[0] + w * twice[0] + last[0], v[1] + w * twice[1] + last[1], v[2] + w * twice[2] + last[2]];
}
