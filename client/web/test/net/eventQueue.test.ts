import { expect, test } from "vitest";
import { LevelIndex } from "../../src/hair/level";
import type { Frame } from "../../src/hair/frame";
import { rigidPose } from "../../src/hair/pose";
import { EventQueue } from "../../src/net/eventQueue";
import type { FrameBatch } from "../../src/net/events";

/** Frames of some megabytes each. */
function batch(tick: number, members: readonly number[], discontinuous = false): FrameBatch {
  const coefficients = new Float32Array(3 << 20);
  const frames = members.map((member) => ({
    member,
    level: LevelIndex.low,
    discontinuous,
    pose: rigidPose(),
    coefficients,
  }));
  return { type: "frameBatch", tick, sampleTimeNs: tick, frames: frames as unknown as Frame[] };
}
const jumps = (queue: EventQueue) =>
  queue
    .takeAll()
    .flatMap((event) => (event.type === "frameBatch" ? event.frames.map((f) => [f.member, f.discontinuous]) : []));

test("a jump whose frame was dropped parts the character's next frame, queued by then or not", () => {
  const queue = new EventQueue();
  queue.push(batch(1, [1, 2], true));
  queue.push(batch(2, [2, 3]));
  expect(queue.framesDropped).toBe(2);
  expect(jumps(queue)).toEqual([
    [2, true],
    [3, false],
  ]);
  queue.push(batch(3, [3]));
  queue.push(batch(4, [1]));
  expect(jumps(queue)).toEqual([
    [3, false],
    [1, true],
  ]);
  queue.push(batch(5, [1]));
  expect(jumps(queue)).toEqual([[1, false]]);
});

test("a discontinuity is not passed on past a member that has left", () => {
  const queue = new EventQueue();
  queue.push(batch(1, [1, 1], true));
  queue.push(batch(2, [2]));
  queue.push({ type: "memberLeft", member: 1 });
  queue.push(batch(3, [1]));
  expect(jumps(queue)).toEqual([
    [2, false],
    [1, false],
  ]);
});
