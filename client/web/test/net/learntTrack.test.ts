import { expect, it } from "vitest";
import { decodeLearnt } from "../../src/net/learntFile";
import { LearntTrack, type LearntFrame } from "../../src/net/learntTrack";
import { learntVectors } from "../support/learntVectors";
import { fromHex, furthest } from "../support/vectors";

// C++ adds in floats, this client in doubles.
const kRoundingM = 1e-6;

it("shows the hair that C++ shows, with and without coefficients, through losses, gaps, jumps and other levels", () => {
  const hair = decodeLearnt(fromHex(learntVectors.file));
  const track = new LearntTrack();
  let last: { pose: Float64Array; tick: number; shown: Float32Array } | null = null;
  let evaluated = 0;
  for (const { tick, pose, coded, shown, ...more } of learntVectors.frames) {
    const to = Float64Array.from(pose);
    const frame: LearntFrame = { from: last?.pose ?? null, to, ticks: last ? tick - last.tick : 0, ...more };
    const got = Float32Array.from(coded);
    track.show(hair, frame, last?.shown ?? null, got);
    expect(furthest(got, shown), `tick ${tick}`).toBeLessThan(kRoundingM);
    last = { pose: to, tick, shown: got };
    evaluated += more.evaluated ? 1 : 0;
  }
  expect(evaluated).toBeGreaterThan(60);
});
