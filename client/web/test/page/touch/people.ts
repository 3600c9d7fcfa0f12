import { Quaternion, Vector3 } from "three";
import type { Pickable } from "../../../page/touch/pick";
import { rigidPose } from "../../../src/hair/pose";
import { madeGroom } from "../../support/madeGroom";

/** Somebody at a place, turned about +Y: hair all around an egg of a head, whose face is outside of the hair. */
export function personAt(
  member: number,
  at: readonly [number, number, number],
  yawRad = 0,
): Pickable & { member: number } {
  const groom = madeGroom();
  const rotation = new Quaternion().setFromAxisAngle(new Vector3(0, 1, 0), yawRad);
  const points = groom.points.slice();
  for (let i = 0; i < points.length; i += 3) {
    const point = new Vector3()
      .fromArray(points, i)
      .applyQuaternion(rotation)
      .add(new Vector3(...at));
    points.set(point.toArray(), i);
  }
  return { member, groom, pose: rigidPose(rotation.toArray(), at), points: () => points };
}
