import { beforeEach, expect, test } from "vitest";
import { GroomQueue } from "../../src/room/groomQueue";

let queue: GroomQueue;
beforeEach(() => {
  queue = new GroomQueue();
});

test("it asks for one groom at a time: that of the largest head first", () => {
  for (const groom of ["far", "near", "hidden"]) queue.add(groom);
  queue.setHeights([
    ["far", 0.1],
    ["near", 0.2],
    ["far", 0.15],
  ]);
  expect(queue.next(0)).toBe("near");
  expect(queue.next(1)).toBeNull();
  queue.finish("near");
  expect(queue.next(2)).toBe("far");
  queue.finish("far");
  expect(queue.next(3)).toBe("hidden");
});

test("a groom has the height of its largest head", () => {
  for (const groom of ["one", "shared"]) queue.add(groom);
  queue.setHeights([
    ["shared", 0.3],
    ["one", 0.2],
    ["shared", 0.1],
  ]);
  expect(queue.next(0)).toBe("shared");
});

test("the first request waits for heights, but not long: an application may never tell any", () => {
  queue.add("first");
  expect(queue.next(1000)).toBeNull();
  queue.setHeights([]);
  expect(queue.next(1100)).toBeNull();
  queue.add("second");
  expect(queue.next(1500)).toBe("first");
  queue.finish("first");
  expect(queue.next(1501)).toBe("second");
});

test("a groom that nobody needs any more is not asked for", () => {
  for (const groom of ["left", "stays"]) queue.add(groom);
  queue.remove("left");
  queue.setHeights([["left", 1]]);
  expect(queue.next(0)).toBe("stays");
  queue.finish("stays");
  expect(queue.next(1)).toBeNull();
});
