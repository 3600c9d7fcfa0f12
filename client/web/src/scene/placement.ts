import { Matrix4, Quaternion, Vector3 } from "three";
import { kBoneCount, kNumbersPerBone, kPoseNumbers, type Pose } from "../hair/pose";
import type { HairCharacter } from "./hairCharacter";

const position = new Vector3();
const rotation = new Quaternion();
const scale = new Vector3();
const roomRotation = new Quaternion();
const roomScale = new Vector3();

/**
 * Puts the character at its head, and returns its pose in scene space and its size. The pose is the room's, moved by
 * the group's matrix, or the anchor's; the other bones keep their places about it.
 */
export function place(character: HairCharacter, pose: Pose, room: Matrix4): { pose: Pose; size: number } {
  const placed: Pose = new Float64Array(kPoseNumbers);
  room.decompose(position, roomRotation, roomScale);
  if (character.anchor) {
    character.anchor.updateWorldMatrix(true, false);
    character.anchor.matrixWorld.decompose(position, rotation, scale);
    const size = scale.x;
    const toHead = new Quaternion(pose[0], pose[1], pose[2], pose[3]).invert();
    const head = new Vector3(pose[4], pose[5], pose[6]);
    for (let at = 0; at < kBoneCount * kNumbersPerBone; at += kNumbersPerBone) {
      const turn = rotation.clone().multiply(toHead);
      const offset = new Vector3(pose[at + 4], pose[at + 5], pose[at + 6])
        .sub(head)
        .applyQuaternion(turn)
        .multiplyScalar(size);
      const own = turn.multiply(new Quaternion(pose[at], pose[at + 1], pose[at + 2], pose[at + 3]));
      put(placed, at, own, offset.add(position));
    }
    setHead(character, room, placed, size / roomScale.x);
    return { pose: placed, size };
  }
  const own = new Quaternion();
  const where = new Vector3();
  for (let at = 0; at < kBoneCount * kNumbersPerBone; at += kNumbersPerBone) {
    own.set(pose[at], pose[at + 1], pose[at + 2], pose[at + 3]).premultiply(roomRotation);
    where.set(pose[at + 4], pose[at + 5], pose[at + 6]).applyMatrix4(room);
    put(placed, at, own, where);
  }
  character.position.set(pose[4], pose[5], pose[6]);
  character.quaternion.set(pose[0], pose[1], pose[2], pose[3]);
  character.scale.setScalar(1);
  return { pose: placed, size: roomScale.x };
}

function setHead(character: HairCharacter, room: Matrix4, pose: Pose, size: number): void {
  const back = roomRotation.clone().invert();
  character.position.set(pose[4], pose[5], pose[6]).applyMatrix4(new Matrix4().copy(room).invert());
  character.quaternion.set(pose[0], pose[1], pose[2], pose[3]).premultiply(back);
  character.scale.setScalar(size);
}

function put(pose: Pose, at: number, q: Quaternion, p: Vector3): void {
  pose[at] = q.x;
  pose[at + 1] = q.y;
  pose[at + 2] = q.z;
  pose[at + 3] = q.w;
  pose[at + 4] = p.x;
  pose[at + 5] = p.y;
  pose[at + 6] = p.z;
}
