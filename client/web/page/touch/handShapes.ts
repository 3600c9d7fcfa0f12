import { Quaternion, Vector3 } from "three";
import type { Hand } from "../../src/index";

/** The shape's own y is the direction from one end of its capsule to the other. */
const kAxisOfShapes = new Vector3(0, 1, 0);
/** A capsule with a shorter axis is a sphere, which has no direction. */
const kAxisMinM = 1e-6;

/**
 * A place (world) in the own axes of one of a hand's shapes: from its middle, with y along its capsule. `Room.takeHold`
 * wants it so. `number`: the shape's, counted from the hand's first number.
 */
export function inAxesOfShape(hand: Hand, number: number, place: Vector3): [number, number, number] {
  const { from, to } = hand.shapes[number - hand.firstNumber];
  const begin = new Vector3().fromArray(from);
  const axis = new Vector3().fromArray(to).sub(begin);
  const own = place
    .clone()
    .sub(new Vector3().fromArray(hand.position))
    .applyQuaternion(new Quaternion().fromArray(hand.rotation).invert())
    .sub(begin)
    .addScaledVector(axis, -0.5);
  if (axis.length() > kAxisMinM)
    own.applyQuaternion(new Quaternion().setFromUnitVectors(kAxisOfShapes, axis.normalize()).invert());
  return own.toArray();
}
