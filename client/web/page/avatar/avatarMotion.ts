import type { VRM, VRMHumanBoneName } from "@pixiv/three-vrm";
import { Object3D, Quaternion, Vector3 } from "three";
import { Bone, kNumbersPerBone, type Pose } from "../../src/index";
import { lowerArms } from "../../src/vrm/index";

/** An angle of the head against the trunk above which a person, and not the idle motion, moves the head. */
const kHeldRad = 0.03;
/** The idle motion is back to its full size this long after the head has stopped. */
const kIdleReturnsS = 1.5;

/** Moves a model: its head, neck and trunk follow a pose, it breathes, and it looks around while its head is still. */
export class AvatarMotion {
  /** Its place in the world; the model is its child. */
  readonly root = new Object3D();
  /** The place of the head joint in the model at rest, whose feet are at height 0, m. */
  readonly headAtRest: Vector3;
  /** The weight of the idle motion, 0 to 1. */
  #idle = 0;
  #timeS = 0;

  constructor(private readonly vrm: VRM) {
    this.root.add(vrm.scene);
    vrm.humanoid.resetNormalizedPose();
    vrm.update(0);
    this.root.updateWorldMatrix(true, true);
    this.headAtRest = vrm.humanoid.getRawBoneNode("head")!.getWorldPosition(new Vector3());
  }

  /** `pose`: world, of the user's head. The model's feet stay, and its neck turns its head. */
  update(pose: Pose, dtS: number): void {
    this.#timeS += dtS;
    const t = this.#timeS;
    const trunk = rotationOf(pose, Bone.upperTrunk);
    const neck = rotationOf(pose, Bone.neck).premultiply(trunk.clone().invert());
    const head = rotationOf(pose, Bone.head).premultiply(rotationOf(pose, Bone.neck).invert());
    // The idle motion fades out within a quarter of a second, and in within kIdleReturnsS.
    const isHeld = 2 * Math.acos(Math.min(Math.abs(neck.clone().multiply(head).w), 1)) > kHeldRad;
    this.#idle = Math.min(Math.max(this.#idle + (isHeld ? -4 : 1 / kIdleReturnsS) * dtS, 0), 1);
    // A smooth step, so that the idle motion neither starts nor ends with a jerk.
    const look = this.#idle * this.#idle * (3 - 2 * this.#idle);
    neck.multiply(turn(look * 0.03 * Math.sin(0.9 * t + 1), look * 0.5 * wander(t), look * 0.02 * Math.sin(0.6 * t)));
    head.multiply(turn(look * 0.04 * wander(t + 40), look * 0.5 * wander(t), look * 0.03 * wander(t + 90)));
    lowerArms(this.vrm);
    this.#turn("neck", neck);
    this.#turn("head", head);
    // A breath takes 2 pi / 1.5 = 4.2 s. It moves spine, chest and shoulders by about a hundredth of a rad.
    const breath = Math.sin(1.5 * t);
    this.#turn("spine", turn(0.006 * breath, 0.02 * Math.sin(0.35 * t), 0.012 * Math.sin(0.5 * t)));
    this.#turn("chest", turn(-0.016 * breath, 0, 0));
    this.#turn("leftShoulder", turn(0, 0, 0.014 * breath));
    this.#turn("rightShoulder", turn(0, 0, -0.014 * breath));
    this.root.quaternion.copy(trunk);
    this.root.position
      .copy(this.headAtRest)
      .applyQuaternion(trunk)
      .multiplyScalar(-1)
      .add(new Vector3().fromArray(pose, Bone.head * kNumbersPerBone + 4));
    // Spring bones start from the first pose: without the reset they would swing from where the model was loaded.
    const isFirst = t === dtS;
    if (isFirst) {
      this.vrm.update(0);
      this.root.updateWorldMatrix(true, true);
      this.vrm.springBoneManager?.reset();
    }
    this.vrm.update(dtS);
  }

  // Bones have the axes of the model. Models of VRM 0 look along -Z.
  #turn(bone: VRMHumanBoneName, { x, y, z, w }: Quaternion): void {
    const sign = this.vrm.meta.metaVersion === "0" ? -1 : 1;
    this.vrm.humanoid.getNormalizedBoneNode(bone)?.quaternion.set(sign * x, y, sign * z, w);
  }
}

function rotationOf(pose: Pose, bone: Bone): Quaternion {
  return new Quaternion().fromArray(pose, bone * kNumbersPerBone);
}

/** Small turns: down, to the model's left, and to its right shoulder. */
function turn(pitchRad: number, yawRad: number, rollRad: number): Quaternion {
  return new Quaternion(0.5 * pitchRad, 0.5 * yawRad, 0.5 * rollRad, 1).normalize();
}

/** A slow angle that rests, then goes elsewhere; about -0.4 to 0.4 rad. */
function wander(t: number): number {
  return 0.4 * Math.tanh(1.8 * (Math.sin(0.37 * t) + Math.sin(0.23 * t + 2)) * Math.sin(0.11 * t + 0.5));
}
