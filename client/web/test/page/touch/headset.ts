import { Matrix4, type Quaternion, Vector3 } from "three";
import type { HandFrame, HandInput } from "../../../page/touch/handsOfHeadset";

/** Fingers along -Z from the wrist, as WebXR has a flat hand: joints by name, own axes of the headset's space, m. */
function flatHand(wrist: Vector3, pinchM: number): Map<string, Vector3> {
  const joints = new Map<string, Vector3>([["wrist", wrist.clone()]]);
  ["index", "middle", "ring", "pinky"].forEach((finger, n) => {
    // The fingers are 2 cm apart. Their knuckles are 9 cm from the wrist, and their tips 17 cm.
    const side = 0.03 - 0.02 * n;
    joints.set(`${finger}-finger-phalanx-proximal`, wrist.clone().add(new Vector3(side, 0, -0.09)));
    joints.set(`${finger}-finger-tip`, wrist.clone().add(new Vector3(side, 0, -0.17)));
  });
  joints.set("thumb-phalanx-proximal", wrist.clone().add(new Vector3(0.05, 0, -0.05)));
  // The tip of the thumb is `pinchM` below that of the forefinger.
  joints.set("thumb-tip", wrist.clone().add(new Vector3(0.03, -pinchM, -0.17)));
  return joints;
}

/** What a headset tells in one frame. Spaces are stood for by the matrices of what is in them. */
export class FakeHeadset implements HandFrame {
  readonly inputs: HandInput[] = [];

  /** `lost`: a joint without tracking. */
  addHand(handedness: XRHandedness, wrist: Vector3, pinchM: number, lost = ""): this {
    const places = [...flatHand(wrist, pinchM)].map(
      ([name, at]) => [name, name === lost ? null : atPlace(at)] as const,
    );
    return this.#add({ handedness, hand: new Map(places) });
  }

  /** Adds a controller. `pressed`: whether each of its buttons is, the trigger first and the squeeze button second. */
  addController(handedness: XRHandedness, place: Vector3, rotation: Quaternion, pressed: readonly boolean[]): this {
    const gripSpace = new Matrix4().compose(place, rotation, new Vector3(1, 1, 1));
    return this.#add({ handedness, gripSpace, gamepad: { buttons: pressed.map((one) => ({ pressed: one })) } });
  }

  getJointPose = (joint: XRJointSpace) => poseOf(joint as never) as XRJointPose | undefined;
  getPose = (space: XRSpace) => poseOf(space as never) as XRPose | undefined;

  #add(input: object): this {
    this.inputs.push(input as HandInput);
    return this;
  }
}

function atPlace(at: Vector3): Matrix4 {
  return new Matrix4().makeTranslation(at);
}

function poseOf(place: Matrix4 | null): unknown {
  return place ? { transform: { matrix: Float32Array.from(place.elements) }, radius: 0.008 } : undefined;
}
