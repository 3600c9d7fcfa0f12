import { Matrix4, Quaternion, Vector3 } from "three";
import { kBoneCount, kNumbersPerBone, kPoseNumbers, type Pose } from "../hair/pose";
import { evenScale } from "./evenScale";
import type { HairCharacter } from "./hairCharacter";

const position = new Vector3();
const rotation = new Quaternion();
const scale = new Vector3();
const halfTurn = new Quaternion(1, 0, 0, 0); // about x

/** Where a character is drawn. */
export interface Placed {
  /** The bones, scene space. */
  readonly pose: Pose;
  /** The character's scale. Negative: it is mirrored in the head joint, and then turned and moved by the pose. */
  readonly size: number;
}

/** Why a character is not drawn: "hidden" by a scale of 0, else one line. */
export type Unplaced = "hidden" | `${string} is not finite` | `${string} is scaled unevenly`;

/**
 * Moves the object `character` to its head, and returns where its hair is drawn in the scene. `pose`: the member's, in
 * the room; `room`: the world matrix of the HairScene, which moves all poses. With an anchor the head is at the anchor,
 * and the other bones keep their places about the head.
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
  of.decompose(position, rotation, scale); // a mirror is one of x, before the rotation
  const placed: Pose = new Float64Array(kPoseNumbers);
  if (anchor) placeAtAnchor(pose, size, placed);
  else placeInRoom(pose, size, room, placed);
  if (anchor) new Matrix4().copy(room).invert().multiply(of).decompose(character.position, character.quaternion, scale);
  else {
    character.position.set(pose[4], pose[5], pose[6]);
    character.quaternion.set(pose[0], pose[1], pose[2], pose[3]);
    scale.setScalar(1);
  }
  character.scale.copy(scale);
  return { pose: placed, size };
}

// `decompose` gives a mirror as a mirror in x before the rotation. That equals a mirror in the origin followed by half
// a turn about x, and shaders know mirrors in the origin only: hence `halfTurn`. The pose of a mirrored model has the
// bones as they stand in the world, each without its mirror.
function placeAtAnchor(pose: Pose, size: number, placed: Pose): void {
  const turn = new Quaternion(pose[0], pose[1], pose[2], pose[3]).invert().premultiply(rotation);
  const head = new Vector3(pose[4], pose[5], pose[6]);
  for (let at = 0; at < kBoneCount * kNumbersPerBone; at += kNumbersPerBone) {
    const own = new Quaternion(pose[at], pose[at + 1], pose[at + 2], pose[at + 3]).premultiply(turn);
    if (size < 0) own.multiply(halfTurn);
    const offset = new Vector3(pose[at + 4], pose[at + 5], pose[at + 6])
      .sub(head)
      .applyQuaternion(turn)
      .multiplyScalar(Math.abs(size));
    put(placed, at, own, offset.add(position));
  }
}

function placeInRoom(pose: Pose, size: number, room: Matrix4, placed: Pose): void {
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
