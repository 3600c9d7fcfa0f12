import { Matrix4, Quaternion, Vector3 } from "three";
import { kBoneCount, kNumbersPerBone, kPoseNumbers, type Pose } from "../hair/pose";
import { evenScale } from "./evenScale";
import type { HairCharacter } from "./hairCharacter";

/** Half a turn about x. */
const halfTurn = new Quaternion(1, 0, 0, 0);

/** The parts of a matrix to world space, as `Matrix4.decompose` gives them. */
interface Parts {
  readonly position: Vector3;
  readonly rotation: Quaternion;
}

/** Where a character is drawn. */
export interface Placed {
  /** The bones, world space. */
  readonly pose: Pose;
  /** The character's scale. Negative: it is mirrored in the head joint, and then turned and moved by the pose. */
  readonly size: number;
}

/** Why a character is not drawn: "hidden" by a scale of 0, else one line. */
export type Unplaced = "hidden" | `${string} is not finite` | `${string} is scaled unevenly`;

/**
 * Moves the object `character`, a child of the HairScene, to its head, and returns where its hair is drawn. `pose`: the
 * member's, room space; `room`: the world matrix of the HairScene, whose local space is room space. With an anchor the
 * head is at the anchor, and the other bones keep their places about the head.
 */
export function place(character: HairCharacter, pose: Pose, room: Matrix4): Placed | Unplaced {
  const { anchor } = character;
  anchor?.updateWorldMatrix(true, false);
  const of = anchor?.matrixWorld ?? room;
  const size = evenScale(of);
  if (size === 0) return "hidden";
  const what = anchor ? `the anchor of character ${character.member}` : "the HairScene's world matrix";
  if (size === null) return `${what} is scaled unevenly`;
  if (Number.isNaN(size)) return `${what} is not finite`;
  // three.js takes a mirrored matrix for a mirror in x, followed by the rotation.
  const parts = { position: new Vector3(), rotation: new Quaternion() };
  of.decompose(parts.position, parts.rotation, new Vector3());
  const placed: Pose = new Float64Array(kPoseNumbers);
  if (anchor) {
    placeAtAnchor(pose, size, parts, placed);
    const local = new Matrix4().copy(room).invert().multiply(of);
    local.decompose(character.position, character.quaternion, character.scale);
  } else {
    placeInRoom(pose, size, room, parts.rotation, placed);
    character.position.set(pose[4], pose[5], pose[6]);
    character.quaternion.set(pose[0], pose[1], pose[2], pose[3]);
    character.scale.setScalar(1);
  }
  return { pose: placed, size };
}

// Writes to `placed`, world space, the bones of `pose`, room space. `anchor`: the parts of the anchor's world matrix,
// where the head is.
//
// `decompose` gives a mirror as a mirror in x before the rotation. That equals a mirror in the origin followed by half
// a turn about x, and shaders know mirrors in the origin only: hence `halfTurn`. The pose of a mirrored model has the
// bones as they stand in the world, each without its mirror.
function placeAtAnchor(pose: Pose, size: number, anchor: Parts, placed: Pose): void {
  const turn = new Quaternion(pose[0], pose[1], pose[2], pose[3]).invert().premultiply(anchor.rotation);
  const head = new Vector3(pose[4], pose[5], pose[6]);
  for (let at = 0; at < kBoneCount * kNumbersPerBone; at += kNumbersPerBone) {
    const own = new Quaternion(pose[at], pose[at + 1], pose[at + 2], pose[at + 3]).premultiply(turn);
    if (size < 0) own.multiply(halfTurn);
    const offset = new Vector3(pose[at + 4], pose[at + 5], pose[at + 6])
      .sub(head)
      .applyQuaternion(turn)
      .multiplyScalar(Math.abs(size));
    put(placed, at, own, offset.add(anchor.position));
  }
}

// Writes to `placed`, world space, the bones of `pose`, room space. `rotation`: that of `room`, the HairScene's world
// matrix.
function placeInRoom(pose: Pose, size: number, room: Matrix4, rotation: Quaternion, placed: Pose): void {
  const turn = rotation.clone();
  if (size < 0) turn.multiply(halfTurn);
  const own = new Quaternion();
  const where = new Vector3();
  for (let at = 0; at < kBoneCount * kNumbersPerBone; at += kNumbersPerBone) {
    own.set(pose[at], pose[at + 1], pose[at + 2], pose[at + 3]).premultiply(turn);
    where.set(pose[at + 4], pose[at + 5], pose[at + 6]).applyMatrix4(room);
    put(placed, at, own, where);
  }
}

/** Writes the bone whose numbers begin at `at`. */
function put(pose: Pose, at: number, q: Quaternion, p: Vector3): void {
  pose[at] = q.x;
  pose[at + 1] = q.y;
  pose[at + 2] = q.z;
  pose[at + 3] = q.w;
  pose[at + 4] = p.x;
  pose[at + 5] = p.y;
  pose[at + 6] = p.z;
}
