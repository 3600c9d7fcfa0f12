import { expect, test } from "vitest";
import { FirstPictures } from "../../page/firstPictures";

// What a picture shows: members, hair, and whether the page still waits for somebody's hair. `add` takes the time since
// the picture before, ms, and this.
const nothing = { hasPeople: false, hasHair: false, isWaiting: true };
const hair = { hasPeople: true, hasHair: true, isWaiting: true };
const desktop = { width: 1280, height: 720 };

test("the first pictures have few pixels, of a window of any size", () => {
  const pictures = new FirstPictures();
  // The first pictures have 640 x 360 pixels at most (kPixels of firstPictures.ts); the share is that of the width.
  expect(pictures.share(desktop)).toBe(0.5);
  expect(pictures.share({ width: 2560, height: 1440 })).toBe(0.25);
  expect(pictures.share({ width: 320, height: 200 })).toBe(1);
});

test("nothing changes before the first hair", () => {
  const pictures = new FirstPictures();
  for (let n = 0; n < 100; ++n) pictures.add(16, nothing);
  pictures.add(1e6, { ...nothing, isWaiting: false });
  expect(pictures.share(desktop)).toBe(0.5);
});

test("a fast machine gets all pixels after a few pictures; a single slow one of them begins the count again", () => {
  const pictures = new FirstPictures();
  // Five pictures in a row must each take at most 28 ms (kFastPictures, kFastMs). The one of 90 ms begins the count
  // again.
  for (const ms of [300, 16, 16, 16, 16, 90, 16, 16, 16, 16]) pictures.add(ms, hair);
  expect(pictures.share(desktop)).toBe(0.5);
  pictures.add(16, hair);
  expect(pictures.share(desktop)).toBe(1);
});

test("a slow machine gets all pixels when everyone has hair, or some seconds after the first hair", () => {
  const ready = new FirstPictures();
  ready.add(700, hair);
  expect(ready.share(desktop)).toBe(0.5);
  ready.add(700, { ...hair, isWaiting: false });
  expect(ready.share(desktop)).toBe(1);
  ready.add(700, hair);
  expect(ready.share(desktop)).toBe(1);
  const waiting = new FirstPictures();
  // 8 s after the first hair pictures get all pixels (kCoarseMs).
  for (let ms = 0; ms < 9000; ms += 300) waiting.add(300, hair);
  expect(waiting.share(desktop)).toBe(1);
});

test("others wait for the first hair, but not long", () => {
  const pictures = new FirstPictures();
  pictures.add(1e5, nothing);
  expect(pictures.holdsOthers).toBe(true);
  expect(pictures.isBeforeHair).toBe(true);
  pictures.add(100, hair);
  expect(pictures.holdsOthers).toBe(false);
  expect(pictures.isBeforeHair).toBe(false);
  const never = new FirstPictures();
  // Others wait 6 s for the first hair (kHoldMs), counted from the first picture with people.
  for (let ms = 0; ms < 7000; ms += 100) never.add(100, { ...nothing, hasPeople: true });
  expect(never.holdsOthers).toBe(false);
});
