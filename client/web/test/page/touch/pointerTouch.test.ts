import { Quaternion, Ray, Vector3 } from "three";
import { expect, test } from "vitest";
import { Holds } from "../../../page/touch/holds";
import { PointerTouch } from "../../../page/touch/pointerTouch";
import type { Member } from "../../../src/index";
import { FakeRoom } from "./fakeRoom";

const place = new Vector3(0.1, 1.5, 0.2);
/** A camera that looks along -X. */
const rotation = new Quaternion().setFromAxisAngle(new Vector3(0, 1, 0), Math.PI / 2);
const eye = new Vector3(2, 1.5, 0.2);
const rayTo = (x: number, y: number, z: number) => new Ray(eye, new Vector3(x, y, z).sub(eye).normalize());

// `onHeld` takes the member, the number of the hand, the count of held points, and the time, ms.
function begin(strokes = false) {
  const room = new FakeRoom([{ member: 1 }]);
  const member = room.members.get(1)!;
  const holds = new Holds();
  const touch = new PointerTouch(holds);
  touch.press({ member, place }, rotation, strokes, room, 0);
  return { room, member, holds, touch, at: (ms: number) => new Vector3().fromArray(touch.hands(ms)[0].position) };
}

test("a press takes hold with a ball at the hair, which then follows the pointer in the plane of the picture", () => {
  const { room, member, touch, at } = begin();
  expect(room.calls).toEqual(["hands 1", "take 1 0"]);
  // The ball has kBallRadiusM of pointerTouch.ts.
  expect(touch.hands(0)[0].shapes).toMatchObject([{ radiusM: 0.012 }]);
  expect(at(0).distanceTo(place)).toBeLessThan(1e-9);
  touch.onHeld(member, 0, 12, 40);
  touch.move(rayTo(-1, 1.2, 0.5));
  // The hand moves at most 2 m/s (kSpeedMPerMs of pointerTouch.ts): 0.1 m in these 50 ms.
  expect(at(50).distanceTo(place)).toBeLessThanOrEqual(0.1 + 1e-9);
  expect(at(50).distanceTo(place)).toBeGreaterThan(0.09);
  const moved = at(1000);
  expect(moved.x).toBeCloseTo(place.x, 9);
  expect(rayTo(-1, 1.2, 0.5).distanceToPoint(moved)).toBeLessThan(1e-9);
  // A ray away from the plane of the picture never meets it, so the hand stays.
  touch.move(new Ray(eye, new Vector3(1, 0, 0)));
  expect(at(1060).distanceTo(moved)).toBeLessThan(1e-9);
  touch.release(false, 1100);
  expect(room.calls.at(-1)).toBe("let go 1 0 drop");
  expect(touch.isPressed).toBe(false);
  expect(touch.hands(1100)).toEqual([]);
});

test("a late answer is waited for, and asked again after it; answers to earlier presses are none", () => {
  const { room, member, touch, at } = begin();
  touch.release(false, 10);
  touch.press({ member, place }, rotation, false, room, 20);
  touch.move(rayTo(0, 1.2, 0.5));
  touch.onHeld(member, 0, 12, 30);
  // The answer belonged to hand 0 of the first press, so the second one still waits: 2 s without an answer
  // (kAnswersMs).
  expect(at(900).distanceTo(place)).toBeLessThan(1e-9);
  touch.onHeld(member, 1, 0, 910);
  expect(room.calls.slice(-2)).toEqual(["take 1 1", "take 1 1"]);
  expect(at(1300).distanceTo(place)).toBeLessThan(1e-9);
  touch.onHeld(member, 1, 9, 1310);
  // Since 1300 ms the hand has moved 2 m/s.
  expect(at(1400).distanceTo(place)).toBeCloseTo(0.2, 6);
});

test("until it holds, the ball waits at the hair and asks again, for half a second", () => {
  const { room, member, touch, at } = begin();
  touch.move(rayTo(0, 1.2, 0.5));
  expect(at(30).distanceTo(place)).toBeLessThan(1e-9);
  touch.onHeld(member, 0, 0, 40);
  // Answers about other members or another hand are ignored.
  touch.onHeld({ member: 2 } as Member, 0, 0, 41);
  touch.onHeld(member, 16, 0, 42);
  expect(room.calls).toEqual(["hands 1", "take 1 0", "take 1 0"]);
  // Half a second after the first answer at 40 ms (kTakesMs) the hand stops to ask and follows the pointer.
  expect(at(600).distanceTo(place)).toBeGreaterThan(0.1);
  touch.onHeld(member, 0, 0, 610);
  expect(room.calls).toHaveLength(3);
});

// A second request would take hold of other hair, which then hangs at the hand without the user's wish.
test("hair that is pulled out of the hand is not taken again", () => {
  const { room, member, touch } = begin();
  touch.onHeld(member, 0, 12, 40);
  touch.onHeld(member, 0, 0, 90);
  expect(room.calls).toEqual(["hands 1", "take 1 0"]);
});

test.each([
  ["a key", (touch: PointerTouch) => touch.release(true, 1000)],
  [
    "a second finger",
    (touch: PointerTouch) => {
      touch.pinLater();
      touch.release(false, 1000);
    },
  ],
])("with %s the hair stays where it is, and the hand leaves a moment later", (_, release) => {
  const { room, member, holds, touch } = begin();
  touch.onHeld(member, 0, 12, 40);
  touch.move(rayTo(0, 1.2, 0.5));
  const [held] = touch.hands(999);
  release(touch);
  expect(room.calls.at(-1)).toBe("let go 1 0 pin");
  // The hand stays for 300 ms (kLingersMs): without a hand the server would let the hair go before it hears of the pin.
  expect(touch.hands(1100)).toEqual([held]);
  expect(touch.hands(1400)).toEqual([]);
  holds.unpin(room, null);
  expect(room.calls.at(-1)).toBe("let go 1 0 unpin");
  expect(holds.hasPinned).toBe(false);
});

test("a stroke moves a palm across the picture and holds nothing", () => {
  const { room, holds, touch, at } = begin(true);
  const [{ shapes }] = touch.hands(0);
  const along = new Vector3().fromArray(shapes[0].to).sub(new Vector3().fromArray(shapes[0].from));
  // The palm is 8 cm long (kPalmHalfLengthM), and lies across the picture of a camera that looks along -x.
  expect(along.length()).toBeGreaterThan(0.05);
  expect(Math.abs(along.applyQuaternion(rotation).x)).toBeLessThan(1e-9);
  touch.move(rayTo(0, 1.2, 0.5));
  expect(at(10).x).toBeCloseTo(place.x, 9);
  touch.release(true, 20);
  expect(room.calls).toEqual(["hands 1"]);
  expect(touch.hands(20)).toEqual([]);
  expect(holds.hasTouched).toBe(true);
});

test("members that have left are neither let go nor unpinned", () => {
  const { room, member, holds, touch } = begin();
  room.members.clear();
  touch.release(true, 10);
  holds.unpin(room, member);
  touch.onHeld(member, 0, 0, 20);
  expect(room.calls).toEqual(["hands 1", "take 1 0"]);
});

test("without a connection nothing is taken or let go, and pins stay to be ended later", () => {
  const { room, member, holds, touch } = begin();
  touch.release(true, 10);
  room.state = "reconnecting";
  holds.unpin(room, null);
  expect(holds.hasPinned).toBe(true);
  touch.press({ member, place }, rotation, false, room, 20);
  touch.release(true, 30);
  expect(room.calls.filter((call) => call !== "hands 1")).toEqual(["take 1 0", "let go 1 0 pin"]);
  room.state = "connected";
  holds.unpin(room, null);
  expect(room.calls.at(-1)).toBe("let go 1 0 unpin");
});
