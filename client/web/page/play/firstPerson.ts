import { Matrix4, Quaternion, Vector3, type PerspectiveCamera } from "three";
import type { Pose } from "../../src/index";
import { kEyes } from "../head/ownHead";

/** The view is 80 degrees high, so that hair at its edges is seen. Portraits have 30 (stage.ts). */
const kFovDeg = 80;
/** Behind the eyes, m: from there the hair beside the face is in the picture. The head itself is not drawn. */
const kBehindEyes = new Vector3(0, 0, -0.1);
/** Turns a camera, which looks along -Z, to where the face looks, +Z. */
const kAboutFace = new Quaternion().setFromAxisAngle(new Vector3(0, 1, 0), Math.PI);

/** Looks out of the own head, so that long hair swings at the edges of the picture. */
export class FirstPerson {
  /** Where the camera was before, for `leave`. */
  readonly #before = new Matrix4();
  readonly #fovBefore: number;

  constructor(private readonly camera: PerspectiveCamera) {
    camera.updateMatrix();
    this.#before.copy(camera.matrix);
    this.#fovBefore = camera.fov;
    camera.fov = kFovDeg;
    camera.updateProjectionMatrix();
  }

  /** Puts the camera into the head of `pose`. */
  follow(pose: Pose): void {
    const rotation = new Quaternion(pose[0], pose[1], pose[2], pose[3]);
    this.camera.position
      .copy(kEyes)
      .add(kBehindEyes)
      .applyQuaternion(rotation)
      .add(new Vector3(pose[4], pose[5], pose[6]));
    this.camera.quaternion.copy(rotation).multiply(kAboutFace);
  }

  /** Puts the camera back to where it was. */
  leave(): void {
    this.camera.fov = this.#fovBefore;
    this.camera.updateProjectionMatrix();
    this.#before.decompose(this.camera.position, this.camera.quaternion, new Vector3());
  }
}
