import { Matrix4, Vector3 } from "three";
import { expect, test } from "vitest";
import { trackedHands } from "../../../page/touch/handsOfHeadset";
import { HeadsetTouch } from "../../../page/touch/headsetTouch";
import { inAxesOfShape } from "../../../page/touch/handShapes";
import { Holds } from "../../../page/touch/holds";
import type { Hand } from "../../../src/index";
import { FakeRoom } from "./fakeRoom";
import { FakeHeadset } from "./headset";
import { personAt } from "./people";

/** A hand with a sphere, number 16, and a capsule from 10 to 30 cm along its own x, number 17. */
const hand: Hand = {
  firstNumber: 16,
  rotation: [0, 0, Math.SQRT1_2, Math.SQRT1_2],
  position: [1, 2, 3],
  shapes: [
    { from: [0, 0, 0], to: [0, 0, 0], radiusM: 0.01 },
    { from: [0.1, 0, 0], to: [0.3, 0, 0], radiusM: 0.01 },
  ],
};

test("places in the axes of a shape are from its middle, with y along the capsule", () => {
  // The hand is turned about z by a quarter: its x is the world's y.
  const near = (place: readonly number[], x: number, y: number, z: number) =>
    expect(new Vector3().fromArray(place).distanceTo(new Vector3(x, y, z))).toBeLessThan(1e-9);
  near(inAxesOfShape(hand, 17, new Vector3(1, 2.2, 3)), 0, 0, 0);
  near(inAxesOfShape(hand, 17, new Vector3(1, 2.3, 3)), 0, 0.1, 0);
  near(inAxesOfShape(hand, 17, new Vector3(1, 2.2, 3.05)), 0, 0, 0.05);
  near(inAxesOfShape(hand, 16, new Vector3(0.9, 2, 3)), 0, 0.1, 0);
});

/** A pinch at the right side of the head of member 2, whose hair begins 9 cm from its middle. */
const wrist = new Vector3(0.06, 1.55, 0.17);
const people = [personAt(1, [0.4, 1.55, 0]), personAt(2, [0, 1.55, 0])];
const handsAt = (pinchM: number, lost = "") => {
  const headset = new FakeHeadset().addHand("right", wrist, pinchM, lost);
  return trackedHands(headset.inputs, headset, {} as XRReferenceSpace, new Matrix4());
};

test("a pinch takes hold of the nearest hair at the forefinger, and lets go when it opens", () => {
  const room = new FakeRoom(people);
  const holds = new Holds();
  const touch = new HeadsetTouch(holds);
  touch.update(handsAt(0.05), room);
  expect(holds.hasTouched).toBe(false);
  for (const pinchM of [0.01, 0.02, 0.01]) touch.update(handsAt(pinchM), room);
  expect(room.calls).toEqual(["take 2 16"]);
  // The pinch is 5 mm below the tip of the forefinger, whose capsule is 8 cm long. `takeHold` wants its place from the
  // middle of the capsule, 4 cm from the tip.
  expect(new Vector3().fromArray(room.place).length()).toBeCloseTo(Math.hypot(0.005, 0.04), 5);
  touch.update(handsAt(0.03), room);
  touch.update(handsAt(0.05), room);
  expect(room.calls).toEqual(["take 2 16", "let go 2 16 drop"]);
});

test("a hand that was lost begins anew: the server has let its hair go", () => {
  const room = new FakeRoom(people);
  const touch = new HeadsetTouch(new Holds());
  touch.update(handsAt(0.01), room);
  touch.update(handsAt(0.01, "wrist"), room);
  expect(room.calls).toEqual(["take 2 16"]);
  touch.update(handsAt(0.01), room);
  expect(room.calls).toEqual(["take 2 16", "take 2 16"]);
});

test("a pinch takes no hair that it may not touch, or that is out of reach, also when it comes near later", () => {
  // The user may not touch the hair of member 2, which the pinch meets. In the far room all hair is out of reach.
  const forbidden = new FakeRoom(people, 2);
  const touch = new HeadsetTouch(new Holds());
  touch.update(handsAt(0.01), forbidden);
  touch.update(handsAt(0.05), forbidden);
  expect(forbidden.calls).toEqual([]);
  const far = new FakeRoom([personAt(1, [1, 1.55, 0])]);
  touch.update(handsAt(0.01), far);
  expect(far.calls).toEqual([]);
  // Hair comes near the hand that is closed by now: only a new pinch takes it.
  const near = new FakeRoom(people);
  touch.update(handsAt(0.01), near);
  expect(near.calls).toEqual([]);
  touch.update(handsAt(0.05), near);
  touch.update(handsAt(0.01), near);
  expect(near.calls).toEqual(["take 2 16"]);
});
