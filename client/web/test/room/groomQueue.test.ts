import { beforeEach, expect, test } from "vitest";
import { GroomQueue } from "../../src/room/groomQueue";

let queue: GroomQueue;
beforeEach(() => {
  queue = new GroomQueue();
});

/** Tells them often enough for the first request. */
function tell(...heights: [groom: string, height: number][]): void {
  for (let n = 0; n < 2; ++n) queue.setHeights(heights);
}

test("it asks for one groom at a time: that of the largest head first", () => {
  for (const groom of ["far", "near", "hidden"]) queue.add(groom);
  tell(["far", 0.1], ["near", 0.2], ["far", 0.15]);
  expect(queue.next(0)).toBe("near");
  expect(queue.next(1)).toBeNull();
  queue.finish("near");
  expect(queue.next(2)).toBe("far");
  queue.finish("far");
  expect(queue.next(3)).toBe("hidden");
});

test("a groom has the height of its largest head", () => {
  for (const groom of ["one", "shared"]) queue.add(groom);
  tell(["shared", 0.3], ["one", 0.2], ["shared", 0.1]);
  expect(queue.next(0)).toBe("shared");
});

test("the first request waits until heights were told twice", () => {
  queue.add("far");
  queue.add("near");
  expect(queue.next(0)).toBeNull();
  queue.setHeights([]);
  queue.setHeights([["far", 0.2]]);
  expect(queue.next(10)).toBeNull();
  queue.setHeights([["near", 0.3]]);
  expect(queue.next(20)).toBe("near");
});

test("the first request does not wait long for an application that tells no heights", () => {
  queue.add("first");
  expect(queue.next(1000)).toBeNull();
  expect(queue.next(1500)).toBeNull();
  expect(queue.next(2000)).toBeNull();
  queue.add("second");
  expect(queue.next(2100)).toBe("first");
  queue.finish("first");
  expect(queue.next(2101)).toBe("second");
});

test("the groom that shall be first is asked for at once, before larger heads", () => {
  for (const groom of ["large", "first"]) queue.add(groom);
  expect(queue.next(0, "first")).toBe("first");
  queue.finish("first");
  tell(["large", 0.5]);
  expect(queue.next(1, "first")).toBe("large");
});

test("a groom that nobody needs any more is not asked for", () => {
  for (const groom of ["left", "stays"]) queue.add(groom);
  queue.remove("left");
  tell(["left", 1]);
  expect(queue.next(0)).toBe("stays");
  queue.finish("stays");
  expect(queue.next(1)).toBeNull();
});

test("while only the first counts, nothing else is asked for", () => {
  for (const groom of ["near", "first"]) queue.add(groom);
  tell(["near", 0.2]);
  expect(queue.next(0, null, true)).toBeNull();
  expect(queue.next(1, "first", true)).toBe("first");
  queue.finish("first");
  expect(queue.next(2, "first", true)).toBeNull();
  expect(queue.next(3, "first")).toBe("near");
});
