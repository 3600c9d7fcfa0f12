import { describe, expect, test } from "vitest";
import {
  boxOf,
  clearBearing,
  clearSwing,
  distanceFor,
  freePart,
  kBareHead,
  type Portrait,
  portraitOf,
} from "../../page/framing";
import { madeGroom } from "../support/madeGroom";

const kFovDeg = 30;
// The portraits are of long hair and of a bob, relative to the head joint, m.
const long: Portrait = { bottom: -0.34, top: 0.16, halfWidth: 0.17 };
const bob: Portrait = { bottom: -0.16, top: 0.16, halfWidth: 0.13 };
// The windows have the panel at the right, no panel, and a folded and an open sheet on a phone. The last one is a phone
// held sideways.
const views = [
  { view: { width: 1280, height: 720 }, covered: { right: 312, bottom: 0 } },
  { view: { width: 1280, height: 720 }, covered: { right: 0, bottom: 0 } },
  { view: { width: 390, height: 844 }, covered: { right: 0, bottom: 110 } },
  { view: { width: 390, height: 844 }, covered: { right: 0, bottom: 405 } },
  { view: { width: 844, height: 390 }, covered: { right: 272, bottom: 0 } },
];

describe("a portrait", () => {
  for (const { view, covered } of views)
    for (const portrait of [long, bob, kBareHead])
      test(`from ${portrait.bottom} m fits into ${view.width}x${view.height} beside ${covered.right}, ${covered.bottom}`, () => {
        const free = freePart(view, covered);
        const distance = distanceFor(boxOf(portrait), kFovDeg, view, free);
        const pxPerM = view.height / (2 * distance * Math.tan((kFovDeg * Math.PI) / 360));
        expect((portrait.top - portrait.bottom) * pxPerM).toBeLessThanOrEqual(free.height);
        expect(2 * portrait.halfWidth * pxPerM).toBeLessThanOrEqual(free.width);
        // The box is the portrait with its margin. It fills the free part in width or in height.
        const fill = Math.max(
          (boxOf(portrait).width * pxPerM) / free.width,
          (boxOf(portrait).height * pxPerM) / free.height,
        );
        expect(fill).toBeCloseTo(1, 6);
      });

  test("fills at least 40 % of a desktop's and of a phone's height", () => {
    for (const { view, covered } of [views[0], views[1], views[2]])
      for (const portrait of [long, bob, kBareHead]) {
        const distance = distanceFor(boxOf(portrait), kFovDeg, view, freePart(view, covered));
        const height = portrait.top - portrait.bottom;
        expect(height / (2 * distance * Math.tan((kFovDeg * Math.PI) / 360))).toBeGreaterThanOrEqual(0.4);
      }
  });

  test("has the hair's width and height, but cuts hair below the chest", () => {
    const groom = madeGroom(40, 12);
    // The portrait is cut at -0.34 m (kBottomMinM of framing.ts): with hair to the knees the face would be tiny.
    // One point is the widest, another one hangs 2 m down, and a third is the highest.
    groom.points[0] = 0.31;
    groom.points[1] = -2;
    groom.points[4] = 0.27;
    const portrait = portraitOf(groom);
    expect(portrait.halfWidth).toBeCloseTo(0.31, 6);
    expect(portrait.top).toBeGreaterThanOrEqual(0.27 - 1e-6);
    expect(portrait.bottom).toBe(-0.34);
    expect(portraitOf(null)).toEqual(kBareHead);
    expect(portraitOf(groom, 2)).toEqual({ bottom: -0.68, top: 2 * portrait.top, halfWidth: 2 * portrait.halfWidth });
  });
});

describe("the camera's bearing", () => {
  const me = { x: 0, z: 0 };
  // Returns whether `other` stands between this person and a camera at that bearing: ahead, and less than 0.3 m beside
  // the line. A person hides what is within 0.32 m (kShoulderM of framing.ts).
  const hides = (bearing: number, other: { x: number; z: number }) =>
    other.x * Math.sin(bearing) + other.z * Math.cos(bearing) > 0 &&
    Math.abs(other.x * Math.cos(bearing) - other.z * Math.sin(bearing)) < 0.3;

  test("shows a face at an angle when nobody is in between", () => {
    // A face is shown from 0.6 rad beside its heading. The distance of the camera is 1.7 m.
    expect(clearBearing(me, 0.3, [], 1.7)).toBeCloseTo(0.9, 6);
    expect(clearBearing(me, 0, [{ x: -0.6, z: 0 }], 1.7)).toBeCloseTo(0.6, 6);
    // Others are behind, not between the person and the camera.
    expect(clearBearing(me, 0, [{ x: 0.6, z: 0 }], 1.7)).toBeCloseTo(-0.6, 6);
  });

  test("goes around people in between", () => {
    for (const other of [
      { x: 0.5, z: 1 },
      { x: 0.3, z: 0.6 },
      { x: 0, z: 1.2 },
    ])
      expect(hides(clearBearing(me, 0, [other], 1.7), other)).toBe(false);
    // People all around leave no clear bearing; the camera must take one nevertheless.
    const around = Array.from({ length: 12 }, (_, n) => ({ x: Math.sin(n / 2), z: Math.cos(n / 2) }));
    expect(Number.isFinite(clearBearing(me, 0, around, 1.7))).toBe(true);
  });

  test("swings until another person would hide this one", () => {
    const other = { x: 0.55, z: 0 };
    const bearing = clearBearing(me, 0, [other], 1.7);
    // 1.7 m is the distance of the camera, and 1.5 rad the largest swing that is asked for.
    const swing = clearSwing(me, bearing, [other], 1.7, 1.5);
    // Any swing that is visible will do: without one the picture would stand still.
    expect(swing).toBeGreaterThan(0.2);
    for (let turn = -swing; turn <= swing; turn += 0.01) expect(hides(bearing + turn, other)).toBe(false);
    expect(clearSwing(me, bearing, [], 1.7, 0.6)).toBe(0.6);
  });
});
