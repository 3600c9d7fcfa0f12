import { Quaternion, Vector3 } from "three";
import { expect, test } from "vitest";
import { headAngles, rotationOfDevice } from "../../../page/head/gyroscope";
import { rotationOf } from "../../../page/head/headPose";

/**
 * The rotation of a device with the angles of a DeviceOrientationEvent, degrees: `alpha` about the vertical, `beta` the
 * tilt to the front, and `gamma` the tilt to the side. `screenDeg`: by how much the picture is turned on the device.
 */
const held = (alpha: number, beta: number, gamma: number, screenDeg = 0) =>
  rotationOfDevice({ alpha, beta, gamma }, screenDeg)!;

test("a device that lies on a table has the world's axes: x east, y north, z up", () => {
  const flat = held(0, 0, 0);
  expect(new Vector3(0, 0, 1).applyQuaternion(flat).z).toBeCloseTo(1);
  // A device that is held upright points north, and its screen faces the user in the south: its z is -y.
  const upright = held(0, 90, 0);
  expect(new Vector3(0, 0, 1).applyQuaternion(upright).y).toBeCloseTo(-1);
  expect(new Vector3(0, 1, 0).applyQuaternion(upright).z).toBeCloseTo(1);
});

test("turned about the vertical, the head turns about its own", () => {
  // Held upright, the device turns by 30 degrees, which is pi / 6.
  const turned = headAngles(held(0, 90, 0), held(30, 90, 0));
  expect(turned.yawRad).toBeCloseTo(Math.PI / 6);
  expect(turned.pitchRad).toBeCloseTo(0);
  expect(turned.rollRad).toBeCloseTo(0);
});

test("tilted back, the face looks up; turned like a wheel, the head tilts as the picture does", () => {
  expect(headAngles(held(0, 90, 0), held(0, 110, 0)).pitchRad).toBeCloseTo((20 * Math.PI) / 180);
  expect(headAngles(held(0, 60, 0), held(0, 40, 0)).pitchRad).toBeCloseTo((-20 * Math.PI) / 180);
  const wheel = new Quaternion().setFromAxisAngle(new Vector3(0, 0, 1), 0.3);
  const start = held(20, 70, 5);
  expect(headAngles(start, start.clone().multiply(wheel)).rollRad).toBeCloseTo(0.3);
});

test("a head with these angles turns exactly as the device, however both are held", () => {
  const start = held(40, 70, -10);
  const now = held(65, 80, 12);
  const [x, y, z, w] = rotationOf(headAngles(start, now));
  expect(
    start
      .clone()
      .multiply(new Quaternion(x, y, z, w))
      .angleTo(now),
  ).toBeLessThan(1e-6);
});

test("on a device held sideways the picture's axes count, not the device's", () => {
  const sideways = held(0, 0, -90, 90);
  const up = new Vector3(0, 1, 0).applyQuaternion(sideways);
  expect(Math.abs(up.z)).toBeCloseTo(1);
  const turned = headAngles(sideways, held(25, 0, -90, 90));
  expect(Math.abs(turned.yawRad)).toBeCloseTo((25 * Math.PI) / 180);
  expect(turned.rollRad).toBeCloseTo(0);
});

// Browsers without a sensor may send one event with null in place of the angles.
test("a device that does not know how it is held gives no rotation", () => {
  expect(rotationOfDevice({ alpha: null, beta: 1, gamma: 1 }, 0)).toBeNull();
});
