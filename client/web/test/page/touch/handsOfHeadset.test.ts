import { Matrix4, Quaternion, Vector3 } from "three";
import { expect, test } from "vitest";
import { isClosed, trackedHands } from "../../../page/touch/handsOfHeadset";
import type { Hand } from "../../../src/index";
import { FakeHeadset } from "./headset";

const space = {} as XRReferenceSpace;
/** The headset's space is 0.5 m above the world's. */
const rig = new Matrix4().makeTranslation(0, 0.5, 0);
const still = new Quaternion();
const tracked = (headset: FakeHeadset) => trackedHands(headset.inputs, headset, space, rig);
/** The two ends of the shape with index `n`, in the world. */
const endsOf = ({ rotation, position, shapes }: Hand, n: number) =>
  [shapes[n].from, shapes[n].to].map((end) =>
    new Vector3()
      .fromArray(end)
      .applyQuaternion(new Quaternion().fromArray(rotation))
      .add(new Vector3().fromArray(position)),
  );

test("two hands are seven capsules each, in the world, with the numbers of their sides", () => {
  const headset = new FakeHeadset()
    .addHand("right", new Vector3(0.2, 1, -0.3), 0.05)
    .addHand("left", new Vector3(-0.2, 1, -0.3), 0.05);
  const hands = tracked(headset);
  expect(hands.map(({ hand }) => [hand.firstNumber, hand.shapes.length])).toEqual([
    [0, 7],
    [16, 7],
  ]);
  // The tip of the forefinger is 3 cm beside the wrist and 17 cm before it (headset.ts). The rig adds 0.5 m to its
  // height.
  const [tip, base] = endsOf(hands[1].hand, hands[1].number - 16);
  expect(tip.distanceTo(new Vector3(0.23, 1.5, -0.47))).toBeLessThan(1e-6);
  expect(base.distanceTo(new Vector3(0.23, 1.5, -0.39))).toBeLessThan(1e-6);
  for (const { radiusM } of hands[1].hand.shapes) expect(radiusM).toBeCloseTo(0.008, 6);
  // Both ends of the palm's capsules are joints: nothing of the hand is far from its wrist.
  for (let n = 0; n < 7; ++n)
    for (const end of endsOf(hands[0].hand, n)) expect(end.distanceTo(new Vector3(-0.2, 1.5, -0.3))).toBeLessThan(0.2);
});

test("a hand of which a joint is lost is not there, and the other is", () => {
  const headset = new FakeHeadset()
    .addHand("left", new Vector3(), 0.05, "ring-finger-tip")
    .addHand("right", new Vector3(), 0.05);
  expect(tracked(headset).map(({ hand }) => hand.firstNumber)).toEqual([16]);
});

test("a pinch is between the tips, closes below 15 mm and opens above 25 mm", () => {
  const [{ place, openM }] = tracked(new FakeHeadset().addHand("left", new Vector3(), 0.02));
  // The tip of the thumb is 2 cm below that of the forefinger, so the pinch is 1 cm below it.
  expect(place.distanceTo(new Vector3(0.03, 0.49, -0.17))).toBeLessThan(1e-6);
  expect(openM).toBeCloseTo(0.02, 6);
  // The limits are kClosesM and kOpensM of handsOfHeadset.ts.
  const closed = [false];
  // At 20 mm the pinch stays as it was: open on the way in, closed on the way out.
  for (const apartM of [0.03, 0.02, 0.014, 0.02, 0.026]) closed.push(isClosed(apartM, closed.at(-1)!));
  expect(closed).toEqual([false, false, false, true, true, false]);
});

test("a controller is a capsule along its handle; the trigger closes, squeezed it pins, and it holds at its front", () => {
  const turned = new Quaternion().setFromAxisAngle(new Vector3(0, 1, 0), Math.PI / 2);
  const at = new Vector3(0.1, 1, 0);
  // The list says whether the trigger and the squeeze button are pressed.
  const [open] = tracked(new FakeHeadset().addController("left", at, turned, [false, false]));
  expect(isClosed(open.openM, true)).toBe(false);
  const [front, back] = [...endsOf(open.hand, 0)].reverse();
  expect(front.distanceTo(open.place)).toBeLessThan(1e-6);
  // A controller's front is along its own -z, which a quarter turn about +Y makes -x.
  expect(front.x).toBeLessThan(back.x);
  expect(open.holdRadiusM).toBeGreaterThan(open.hand.shapes[0].radiusM);
  const [pulled] = tracked(new FakeHeadset().addController("left", at, turned, [true, true]));
  expect(isClosed(pulled.openM, false)).toBe(true);
  expect([open.pins, pulled.pins]).toEqual([false, true]);
  expect(tracked(new FakeHeadset().addController("none", at, still, [true]))).toEqual([]);
});
