import { Matrix4, Quaternion, Vector3, type Camera } from "three";
import type { Pose } from "../../src/index";
import { followYaw, poseOf, rotationOf, yawOf, type HeadAngles } from "./headPose";
import type { HeadSource } from "./headSource";

/** The head turns (yaw), nods (pitch) and tilts (roll) at most this far from its direction at rest. */
const kTurnMaxRad = 1.2;
const kNodMaxRad = 0.7;
const kTiltMaxRad = 0.6;
const kAhead: HeadAngles = { yawRad: 0, pitchRad: 0, rollRad: 0 };
/** A drag by one pixel turns the head by this angle. */
const kRadPerPx = 0.007;
/** A drag by one pixel moves the head by this length for each metre between camera and head. */
const kMPerPx = 0.0009;
/** A held arrow key turns the head at this speed, up to the limits above. */
const kKeyRadPerS = 4;
/** The rate, 1/s, at which the difference between the head's angles and the wanted ones decays. */
const kEagerness = 12;

/** The part of `WebGLRenderer.xr` that a head needs. */
export interface HeadsetView {
  getReferenceSpace(): XRReferenceSpace | null;
  getFrame(): Pick<XRFrame, "getViewerPose"> | null;
}

/**
 * The user's own head, controlled by mouse, keys, the view, a sensor or a headset. Angles are relative to its direction
 * at rest.
 */
export class OwnHead {
  /** The place of the head joint, world, m. */
  readonly position = new Vector3();
  /** The direction of the head at rest, as an angle about +Y from +Z, rad. */
  heading = 0;
  /** The head looks where the camera looks, instead of where it is dragged. */
  followsView = false;
  /** A sensor that turns the head; while it knows nothing, mouse and keys do. */
  source: HeadSource | null = null;
  /** The angles to which the head is going, from its direction at rest. */
  #wanted: HeadAngles = kAhead;
  /** The angles of the last pose, which come nearer to the wanted ones in each picture (kEagerness). */
  #now: HeadAngles = kAhead;
  /** The direction of the trunk about +Y, rad. */
  #bodyYaw = 0;
  #isGrabbed = false;
  /** The rotation of the head in the last tracked pose of a headset. */
  readonly #headset = new Quaternion();
  /** The arrow keys that are down. */
  readonly #keys = new Set<string>();

  placeAt(position: Vector3, heading: number): void {
    this.position.copy(position);
    this.heading = heading;
    this.#bodyYaw = heading;
  }

  /** A key of the view was pressed. Returns true if the head uses it. */
  onKey(key: string): boolean {
    if (!key.startsWith("Arrow")) return false;
    this.#keys.add(key);
    return true;
  }

  /** A key was released; all keys without an argument. */
  onKeyUp(key?: string): void {
    if (key === undefined) this.#keys.clear();
    else this.#keys.delete(key);
  }

  grab(): void {
    this.#isGrabbed = true;
  }

  /** Drags the grabbed head by that many pixels; `moves`: along the picture instead of about the neck. */
  drag(dx: number, dy: number, moves: boolean, camera: Camera): void {
    if (moves) {
      const right = new Vector3().setFromMatrixColumn(camera.matrixWorld, 0);
      const up = new Vector3().setFromMatrixColumn(camera.matrixWorld, 1);
      const distance = this.position.distanceTo(camera.getWorldPosition(new Vector3()));
      this.position.addScaledVector(right, dx * kMPerPx * distance).addScaledVector(up, -dy * kMPerPx * distance);
    } else {
      this.#turn(dx * kRadPerPx, dy * kRadPerPx);
    }
  }

  release(): void {
    this.#isGrabbed = false;
  }

  /** Returns the pose at this moment. */
  update(dtS: number, camera: Camera): Pose {
    const keysTurn = this.#turnByKeys(dtS);
    const sensed = this.source?.angles;
    if (this.followsView) this.#lookAlong(camera);
    else if (!this.#isGrabbed && !keysTurn) this.#wanted = sensed ?? kAhead;
    this.#wanted = {
      yawRad: clamp(this.#wanted.yawRad, kTurnMaxRad),
      pitchRad: clamp(this.#wanted.pitchRad, kNodMaxRad),
      rollRad: clamp(this.#wanted.rollRad, kTiltMaxRad),
    };
    const share = 1 - Math.exp(-kEagerness * dtS);
    const nearer = (now: number, wanted: number) => now + share * (wanted - now);
    this.#now = {
      yawRad: nearer(this.#now.yawRad, this.#wanted.yawRad),
      pitchRad: nearer(this.#now.pitchRad, this.#wanted.pitchRad),
      rollRad: nearer(this.#now.rollRad, this.#wanted.rollRad),
    };
    const angles: HeadAngles = { ...this.#now, yawRad: this.heading + this.#now.yawRad };
    // The trunk follows from the heading and not from where it was, so it comes back when the head does.
    this.#bodyYaw = followYaw(this.heading, angles.yawRad);
    return poseOf(rotationOf(angles), [this.position.x, this.position.y, this.position.z], this.#bodyYaw);
  }

  /**
   * The pose of a headset at this moment: it looks along -Z from between the eyes, which are above and in front of the
   * head joint. `rig` carries it in the world. While the headset is not tracked, the pose stays.
   */
  ofHeadset(xr: HeadsetView, rig: Matrix4): Pose {
    const space = xr.getReferenceSpace();
    const viewer = space ? xr.getFrame()?.getViewerPose(space) : null;
    if (viewer) {
      const eye = new Vector3();
      new Matrix4().fromArray(viewer.transform.matrix).premultiply(rig).decompose(eye, this.#headset, new Vector3());
      // A headset looks along -Z, and a head in head space along +Z: half a turn about +Y lies between them.
      this.#headset.multiply(new Quaternion().setFromAxisAngle(new Vector3(0, 1, 0), Math.PI));
      this.position.copy(eye).sub(kEyes.clone().applyQuaternion(this.#headset));
    }
    const { x, y, z, w } = this.#headset;
    this.#bodyYaw = followYaw(this.#bodyYaw, yawOf([x, y, z, w]));
    return poseOf([x, y, z, w], [this.position.x, this.position.y, this.position.z], this.#bodyYaw);
  }

  #turnByKeys(dtS: number): boolean {
    const pressed = (key: string) => (this.#keys.has(key) ? 1 : 0);
    const yaw = pressed("ArrowRight") - pressed("ArrowLeft");
    const pitch = pressed("ArrowDown") - pressed("ArrowUp");
    this.#turn(yaw * kKeyRadPerS * dtS, pitch * kKeyRadPerS * dtS);
    return yaw !== 0 || pitch !== 0;
  }

  #turn(yawRad: number, pitchRad: number): void {
    const { yawRad: yaw, pitchRad: pitch, rollRad } = this.#wanted;
    this.#wanted = { yawRad: yaw + yawRad, pitchRad: pitch + pitchRad, rollRad };
  }

  // Turns the head to the camera's direction.
  #lookAlong(camera: Camera): void {
    const forward = camera.getWorldDirection(new Vector3());
    const yaw = Math.atan2(forward.x, forward.z) - this.heading;
    this.#wanted = {
      yawRad: Math.atan2(Math.sin(yaw), Math.cos(yaw)),
      pitchRad: -Math.asin(Math.min(Math.max(forward.y, -1), 1)),
      rollRad: 0,
    };
  }
}

/** The point between the eyes, from the head joint, head space, m. */
export const kEyes = new Vector3(0, 0.085, 0.085);

function clamp(x: number, most: number): number {
  return Math.min(Math.max(x, -most), most);
}
