import { Matrix4, Quaternion, Vector3 } from "three";
import type { Hand, HandShape } from "../../src/index";

/** A tracked joint, world. */
export interface JointPlace {
  readonly position: Vector3;
  readonly rotation: Quaternion;
  readonly radiusM: number;
}

/** A hand, or a controller in it. */
export interface TrackedHand {
  readonly hand: Hand;
  /** The number of the shape that takes hold of hair, among the shapes of this person. */
  readonly number: number;
  /** The place where it takes hold, world, m. */
  readonly place: Vector3;
  /** Hair within this distance of `place` is held, m. */
  readonly holdRadiusM: number;
  /** The distance from thumb to forefinger, m. A controller has 0 while its trigger is pulled, else infinity. */
  readonly openM: number;
  /** Hair that it lets go now stays where it is. */
  readonly pins: boolean;
}

/** The part of `XRInputSource` that a hand needs. */
export type HandInput = Pick<XRInputSource, "handedness" | "hand" | "gripSpace" | "gamepad">;
/** The part of `XRFrame` that a hand needs. */
export type HandFrame = Pick<XRFrame, "getPose" | "getJointPose">;

/**
 * The number of the first shape of each hand. A person has 32 numbers for shapes (`Hand.firstNumber`): half for each
 * hand.
 */
const kFirstNumbers: Partial<Record<XRHandedness, number>> = { left: 0, right: 16 };
/**
 * Each capsule's joints. Fingers begin at their tips: bent into the palm they then point along y of the wrist, whose
 * shortest way to the axis of shapes is clear.
 */
const kParts = [
  ["index-finger-tip", "index-finger-phalanx-proximal"],
  ["thumb-tip", "thumb-phalanx-proximal"],
  ["middle-finger-tip", "middle-finger-phalanx-proximal"],
  ["ring-finger-tip", "ring-finger-phalanx-proximal"],
  ["pinky-finger-tip", "pinky-finger-phalanx-proximal"],
  ["index-finger-phalanx-proximal", "wrist"],
  ["pinky-finger-phalanx-proximal", "wrist"],
] as const satisfies readonly (readonly [XRHandJoint, XRHandJoint])[];
/** The capsule of the forefinger, the first of kParts, takes hold of hair. */
const kIndexPart = 0;
/** A pinch takes hold of hair within this distance of the middle between thumb and forefinger. */
const kPinchHoldRadiusM = 0.03;
/** A joint has this radius where the headset reports none. */
const kJointRadiusM = 0.01;
/** A joint counts as no thicker than this, whatever the headset reports. */
const kJointRadiusMaxM = 0.03;
/** A controller's capsule reaches this far from the grip's origin to both ends of its handle; its front is at -z. */
const kControllerHalfLengthM = 0.05;
const kControllerRadiusM = 0.02;
/** A controller takes hold of hair within this distance of its front. */
const kControllerHoldRadiusM = 0.05;
/** The indices of trigger and squeeze button in the WebXR standard mapping of gamepads. */
const kTrigger = 0;
const kSqueeze = 1;
/** A pinch begins below the first distance between thumb and forefinger, and ends at the second one. */
const kClosesM = 0.015;
const kOpensM = 0.025;

/**
 * Whether thumb and forefinger pinch. The distance that ends a pinch is larger than the one that begins it: otherwise
 * noise of the tracking would drop the hair.
 */
export function isClosed(openM: number, wasClosed: boolean): boolean {
  return openM < (wasClosed ? kOpensM : kClosesM);
}

/** A hand of seven capsules, in the axes of its wrist; null: not all joints are tracked. */
export function handOfJoints(firstNumber: number, joint: (name: XRHandJoint) => JointPlace | null): TrackedHand | null {
  const wrist = joint("wrist");
  if (!wrist) return null;
  const back = wrist.rotation.clone().invert();
  const own = ({ position }: JointPlace) => position.clone().sub(wrist.position).applyQuaternion(back).toArray();
  const shapes: HandShape[] = [];
  for (const [from, to] of kParts) {
    const [a, b] = [joint(from), joint(to)];
    if (!a || !b) return null;
    shapes.push({ from: own(a), to: own(b), radiusM: (a.radiusM + b.radiusM) / 2 });
  }
  const [thumb, finger] = [joint("thumb-tip")!.position, joint("index-finger-tip")!.position];
  return {
    hand: { firstNumber, rotation: wrist.rotation.toArray(), position: wrist.position.toArray(), shapes },
    number: firstNumber + kIndexPart,
    place: thumb.clone().lerp(finger, 0.5),
    holdRadiusM: kPinchHoldRadiusM,
    openM: thumb.distanceTo(finger),
    pins: false,
  };
}

/** A controller as one capsule along its handle, which takes hold at its front. */
export function handOfController(
  firstNumber: number,
  grip: Omit<JointPlace, "radiusM">,
  isPulled: boolean,
  pins: boolean,
): TrackedHand {
  const shape = {
    from: [0, 0, kControllerHalfLengthM],
    to: [0, 0, -kControllerHalfLengthM],
    radiusM: kControllerRadiusM,
  } as const;
  return {
    hand: { firstNumber, rotation: grip.rotation.toArray(), position: grip.position.toArray(), shapes: [shape] },
    number: firstNumber,
    place: new Vector3().fromArray(shape.to).applyQuaternion(grip.rotation).add(grip.position),
    holdRadiusM: kControllerHoldRadiusM,
    openM: isPulled ? 0 : Infinity,
    pins,
  };
}

/** The hands of this moment, the left first. `space` is that of the headset, which `rig` carries in the world. */
export function trackedHands(
  inputs: Iterable<HandInput>,
  frame: HandFrame,
  space: XRReferenceSpace,
  rig: Matrix4,
): TrackedHand[] {
  const hands: TrackedHand[] = [];
  for (const input of inputs) {
    const firstNumber = kFirstNumbers[input.handedness];
    if (firstNumber === undefined || hands.some((one) => one.hand.firstNumber === firstNumber)) continue;
    const { hand, gripSpace, gamepad } = input;
    const joint = (name: XRHandJoint) => {
      const at = hand?.get(name);
      const pose = at && frame.getJointPose?.(at, space);
      if (!pose) return null;
      const radiusM = Math.min(pose.radius || kJointRadiusM, kJointRadiusMaxM);
      return { ...inWorld(pose.transform, rig), radiusM };
    };
    const grip = !hand && gripSpace ? frame.getPose(gripSpace, space) : null;
    const isPressed = (button: number) => gamepad?.buttons[button]?.pressed ?? false;
    const tracked = hand
      ? handOfJoints(firstNumber, joint)
      : grip && handOfController(firstNumber, inWorld(grip.transform, rig), isPressed(kTrigger), isPressed(kSqueeze));
    if (tracked) hands.push(tracked);
  }
  return hands.sort((a, b) => a.number - b.number);
}

function inWorld({ matrix }: Pick<XRRigidTransform, "matrix">, rig: Matrix4): Omit<JointPlace, "radiusM"> {
  const [position, rotation] = [new Vector3(), new Quaternion()];
  new Matrix4().fromArray(matrix).premultiply(rig).decompose(position, rotation, new Vector3());
  return { position, rotation };
}
