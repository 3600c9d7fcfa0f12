import { Matrix4, PerspectiveCamera, Quaternion, Vector3 } from "three";
import { expect, test } from "vitest";
import { OwnHead, type HeadsetView } from "../../../page/head/ownHead";
import { poseError } from "../../../src/hair/pose";

const camera = new PerspectiveCamera();
camera.position.set(0, 1.6, 2);
camera.updateMatrixWorld();

const yawOf = (pose: Float64Array) => 2 * Math.asin(pose[1]);

test("a dragged head follows the mouse, and returns smoothly after its release", () => {
  const head = new OwnHead();
  head.placeAt(new Vector3(0, 1.6, 0), 0);
  head.grab();
  // 80 pixels turn the head by 0.56 rad (kRadPerPx of ownHead.ts). The other arguments are the pixels downwards, and
  // whether the drag moves the head instead of turning it.
  head.drag(80, 0, false, camera);
  let before = 0;
  for (let n = 0; n < 60; ++n) {
    const yaw = yawOf(head.update(1 / 60, camera));
    expect(yaw).toBeGreaterThanOrEqual(before - 1e-9);
    // A larger step in one picture would be a visible jump.
    expect(yaw - before).toBeLessThan(0.15);
    before = yaw;
  }
  expect(before).toBeGreaterThan(0.5);
  head.release();
  // Within 1.5 s the difference decays by a factor of e^18 (kEagerness).
  for (let n = 0; n < 90; ++n) before = yawOf(head.update(1 / 60, camera));
  expect(Math.abs(before)).toBeLessThan(0.01);
});

test("a head turns no further than necks do, for any drag or key press", () => {
  const head = new OwnHead();
  head.grab();
  head.drag(1e5, -1e5, false, camera);
  head.onKey("ArrowDown");
  let pose = head.update(0.1, camera);
  for (let n = 0; n < 200; ++n) pose = head.update(0.1, camera);
  expect(poseError(pose)).toBeNull();
  // The limits are 1.2 rad to the side and 0.7 rad up and down (kTurnMaxRad, kNodMaxRad); both together turn the head
  // by less than 1.5 rad.
  expect(2 * Math.acos(Math.abs(pose[3]))).toBeLessThan(1.5);
});

test("keys turn it until their release; it ignores other keys", () => {
  const head = new OwnHead();
  expect(head.onKey("a")).toBe(false);
  expect(head.onKey("ArrowLeft")).toBe(true);
  let yaw = 0;
  for (let n = 0; n < 30; ++n) yaw = yawOf(head.update(1 / 60, camera));
  // In half a second the key turns the head by 2 rad (kKeyRadPerS), that is to its limit, and the head follows
  // smoothly.
  expect(yaw).toBeLessThan(-0.3);
  head.onKeyUp();
  for (let n = 0; n < 90; ++n) yaw = yawOf(head.update(1 / 60, camera));
  expect(Math.abs(yaw)).toBeLessThan(0.01);
});

test("moved with Shift it stays where it was put", () => {
  const head = new OwnHead();
  head.placeAt(new Vector3(0, 1.6, 0), 0);
  head.grab();
  head.drag(100, 0, true, camera);
  head.release();
  const pose = head.update(1, camera);
  // The camera is 2 m away, so 100 pixels move the head by 100 * 0.0009 * 2 = 0.18 m (kMPerPx of ownHead.ts).
  expect(pose[4]).toBeGreaterThan(0.05);
  expect(pose[5]).toBeCloseTo(1.6);
});

test("a headset's eyes are where the pose has them, and its trunk stays upright", () => {
  const eye = new Vector3(0.2, 1.65, -0.4);
  const look = new Quaternion().setFromAxisAngle(new Vector3(0, 1, 0), 0.4);
  const matrix = new Matrix4().compose(eye, look, new Vector3(1, 1, 1));
  const rig = new Matrix4().makeTranslation(1, -1.6, 0);
  // A headset that loses its tracking gives no viewer's pose. The head must then stay where it was.
  const seen = (tracked: boolean): HeadsetView => ({
    getReferenceSpace: () => ({}) as XRReferenceSpace,
    getFrame: () => ({
      getViewerPose: () =>
        tracked ? ({ transform: { matrix: new Float32Array(matrix.elements) } } as unknown as XRViewerPose) : undefined,
    }),
  });
  const head = new OwnHead();
  const pose = head.ofHeadset(seen(true), rig);
  expect(poseError(pose)).toBeNull();
  const rotation = new Quaternion(pose[0], pose[1], pose[2], pose[3]);
  const forward = new Vector3(0, 0, 1).applyQuaternion(rotation);
  const looked = new Vector3(0, 0, -1).applyQuaternion(look);
  expect(forward.distanceTo(looked)).toBeLessThan(1e-6);
  // The eyes are at this place from the head joint (kEyes of ownHead.ts).
  const eyes = new Vector3(0, 0.085, 0.085).applyQuaternion(rotation).add(new Vector3(pose[4], pose[5], pose[6]));
  expect(eyes.distanceTo(eye.clone().applyMatrix4(rig))).toBeLessThan(1e-6);
  expect([...head.ofHeadset(seen(false), rig)]).toEqual([...pose]);
});
