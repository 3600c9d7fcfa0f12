import { Ray, Vector3 } from "three";
import { expect, test } from "vitest";
import { nearestHair, pickHair } from "../../../page/touch/pick";
import { personAt } from "./people";

/** The angle within which a press counts as on a hair: some 2 cm at the 3 m of these rays. */
const kWithinRad = 0.008;
const rayFrom = (from: [number, number, number], to: [number, number, number]) =>
  new Ray(new Vector3(...from), new Vector3(...to).sub(new Vector3(...from)).normalize());

test("a press finds the hair that the eye sees first, on the nearer side of the nearer person", () => {
  const people = [personAt(1, [0, 1.6, 0]), personAt(2, [1, 1.6, 0])];
  const ray = rayFrom([3, 1.6, 0], [0, 1.6, 0]);
  const picked = pickHair(ray, kWithinRad, people);
  expect(picked?.member.member).toBe(2);
  // The hair is 0.09 m from the axis of the head at x = 1, and the ray comes from x = 3.
  expect(picked!.place.x).toBeGreaterThan(1.08);
  expect(ray.distanceToPoint(picked!.place)).toBeLessThan(kWithinRad * 2);
});

test("beside all hair, and behind the eye, there is none", () => {
  const people = [personAt(1, [0, 1.6, 0])];
  expect(pickHair(rayFrom([3, 1.9, 0], [0, 1.9, 0]), kWithinRad, people)).toBeNull();
  expect(pickHair(rayFrom([3, 1.6, 0], [6, 1.6, 0]), kWithinRad, people)).toBeNull();
  expect(pickHair(rayFrom([3, 1.6, 0], [0, 1.6, 0]), kWithinRad, [])).toBeNull();
});

test("a face hides the hair behind it, of oneself and of others, and turns with its head", () => {
  // The ray is 8 cm above the head joint, at the height of the egg's middle. There the egg reaches 0.12 m forward,
  // beyond the hair at 0.09 m, and not as far as the hair to the sides and at the back.
  const ray = rayFrom([0, 1.68, 3], [0, 1.68, 0]);
  expect(pickHair(ray, kWithinRad, [personAt(1, [0, 1.6, 0])])).toBeNull();
  expect(pickHair(ray, kWithinRad, [personAt(1, [0, 1.6, 0], Math.PI)])?.member.member).toBe(1);
  expect(pickHair(rayFrom([3, 1.68, 0], [0, 1.68, 0]), kWithinRad, [personAt(1, [0, 1.6, 0], Math.PI / 2)])).toBeNull();
  const behind = personAt(2, [0, 1.6, -1], Math.PI);
  expect(pickHair(ray, kWithinRad, [behind])?.member.member).toBe(2);
  expect(pickHair(ray, kWithinRad, [behind, personAt(1, [0, 1.6, 0])])).toBeNull();
});

test("the own skull hides nothing from an eye in it", () => {
  const people = [personAt(1, [0, 1.6, 0]), personAt(2, [0, 1.6, 1])];
  expect(pickHair(rayFrom([0, 1.68, 0], [0, 1.68, 1]), kWithinRad, people)?.member.member).toBe(2);
});

test("a hand finds whose hair is nearest, and nobody's out of reach", () => {
  const people = [personAt(1, [0, 1.6, 0]), personAt(2, [0.25, 1.6, 0])];
  // The hair of the two begins 0.09 m from their axes, at x = 0.09 and x = 0.16. The first two places are 1 cm from it,
  // and the third one is 0.3 m in front of both.
  expect(nearestHair(new Vector3(0.1, 1.6, 0), 0.03, people)?.member).toBe(1);
  expect(nearestHair(new Vector3(0.15, 1.6, 0), 0.03, people)?.member).toBe(2);
  expect(nearestHair(new Vector3(0.125, 1.6, 0.3), 0.03, people)).toBeNull();
});
