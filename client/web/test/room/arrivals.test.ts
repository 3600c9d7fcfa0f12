import { expect, test } from "vitest";
import { Arrivals } from "../../src/room/arrivals";

const ms = 1_000_000;

test("a frame arrives when it is seen, while the thread is awake", () => {
  const arrivals = new Arrivals();
  for (let t = 0; t < 2000; t += 33) {
    arrivals.onAwake(t * ms);
    expect(arrivals.timeOf((t - 20) * ms, (t + 5) * ms)).toBe((t + 5) * ms);
  }
});

test("frames that came while the thread stood still were on time, but never before it stood still", () => {
  const arrivals = new Arrivals();
  let t = 0;
  for (; t < 1000; t += 20) {
    arrivals.onAwake(t * ms);
    arrivals.timeOf((t - 30) * ms, t * ms);
  }
  const awake = (t - 20) * ms;
  // Two seconds later thirty frames are read at once.
  const seen = awake + 2000 * ms;
  let before = 0;
  for (let n = 1; n < 60; ++n) {
    const sample = awake + n * 33 * ms;
    const arrival = arrivals.timeOf(sample, seen);
    expect(arrival - sample).toBeLessThan(36 * ms);
    expect(arrival).toBeGreaterThanOrEqual(Math.max(awake, before));
    expect(arrival).toBeLessThanOrEqual(seen);
    before = arrival;
  }
  expect(arrivals.timeOf(awake - 500 * ms, seen)).toBe(awake);
});

test("the first frames arrive when they are seen, whatever went before", () => {
  expect(new Arrivals().timeOf(0, 5000 * ms)).toBe(5000 * ms);
});
