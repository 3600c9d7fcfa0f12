import { describe, expect, it } from "vitest";
import { displacementsOf, type HairBasis } from "../../src/hair/basis";
import type { Frame } from "../../src/hair/frame";
import { LevelIndex } from "../../src/hair/level";
import { Playout, type PlayoutSample } from "../../src/hair/playout";
import { rigidPose } from "../../src/hair/pose";
import { decodeBasis } from "../../src/net/basisFile";
import { fullGrid } from "../support/shapes";
import { fromHex, furthest, seeded, vectors } from "../support/vectors";

/** Of the active nodes; empty: at rest. */
function displacementOf({ basis, coefficients }: PlayoutSample): Float32Array {
  const out = new Float32Array(3 * (basis?.basis.nodeCount ?? 0));
  if (basis) displacementsOf(basis.basis, coefficients, out);
  return out;
}

interface PushedFrame {
  level: number;
  discontinuous: boolean;
  asleep: boolean;
  repeated: boolean;
  stepS: number;
  pose: number[];
  coefficients: number[];
  /** index of its basis; -1: none */
  basis: number;
}
interface PushStep {
  push: PushedFrame;
  sampleTimeNs: number;
  arrivalTimeNs: number;
}
interface SampleStep {
  sample: number;
  valid: boolean;
  timeNs: number;
  delayNs: number;
  level: number;
  pose: number[];
  displacement: number[];
  droppedCount: number;
}
type Step = PushStep | SampleStep | { freeze: true };
interface PlayoutVector {
  name: string;
  /** files */
  bases: string[];
  steps: Step[];
}

/** Of another client's character, at rest where `more` says nothing. */
function frameOf(more: Partial<Frame>): Frame {
  return {
    member: 1,
    character: 0,
    level: LevelIndex.low,
    discontinuous: false,
    asleep: false,
    repeated: false,
    lastKnown: false,
    stepStride: 1,
    stepS: 1 / 30,
    pose: rigidPose(),
    coefficients: new Float32Array(0),
    basis: null,
    ...more,
  };
}

describe("play-out", () => {
  for (const scene of vectors<PlayoutVector[]>("playout.json")) {
    it(`shows ${scene.name} as the C++ client does`, () => {
      const bases = scene.bases.map((file) => decodeBasis(fromHex(file)));
      const playout = new Playout();
      for (const step of scene.steps) {
        if ("freeze" in step) playout.freeze();
        else if ("push" in step) {
          const { pose, coefficients, basis, ...same } = step.push;
          const frame = frameOf({
            ...same,
            pose: Float64Array.from(pose),
            coefficients: Float32Array.from(coefficients),
            basis: bases[basis] ?? null,
          });
          playout.push(frame, step.sampleTimeNs, step.arrivalTimeNs);
        } else {
          const sample = playout.sample(step.sample);
          expect(sample !== null).toBe(step.valid);
          if (!sample) continue;
          expect(Math.abs(sample.timeNs - step.timeNs)).toBeLessThan(2);
          expect(Math.abs(playout.delayNs - step.delayNs)).toBeLessThan(2);
          expect(sample.level).toBe(step.level);
          expect(furthest(sample.pose, step.pose)).toBeLessThan(1e-6);
          expect(furthest(displacementOf(sample), step.displacement)).toBeLessThan(1e-6);
          expect(sample.basis === null).toBe(step.displacement.length === 0);
          expect(playout.droppedCount).toBe(step.droppedCount);
        }
      }
    });
  }

  const frameAt = (x: number): Frame => frameOf({ pose: rigidPose([0, 0, 0, 1], [x, 0, 0]) });

  it("shows nothing before the first frame", () => {
    expect(new Playout().sample(0)).toBeNull();
  });

  it("never goes back in time, whatever arrives when", () => {
    const playout = new Playout();
    let last = -Infinity;
    for (let n = 0; n < 400; ++n) {
      const t = n * 33e6;
      playout.push(frameAt(n), t - (n % 7 === 0 ? 200e6 : 0), t + ((n * 37) % 90) * 1e6);
      const shown = playout.sample(t + 40e6 - (n % 11) * 5e6)!.timeNs;
      expect(shown).toBeGreaterThanOrEqual(last);
      last = shown;
    }
  });

  it("writes each sample into the same arrays, and never into those of frames", () => {
    const playout = new Playout();
    const frames = Array.from({ length: 40 }, (_, n) =>
      frameOf({
        pose: rigidPose([0, 0, 0, 1], [n, 0, 0]),
        coefficients: Float32Array.of(n, 2 * n, 3 * n),
        basis: oneNode,
        asleep: n === 39,
      }),
    );
    let shown: PlayoutSample | null = null;
    for (const [n, frame] of frames.entries()) {
      playout.push(frame, n * 33e6, n * 33e6 + (n % 5) * 9e6);
      if (n === 20) playout.freeze();
      const sample = playout.sample(n * 33e6 + 40e6)!;
      if (shown) expect(sample).toBe(shown);
      shown = sample;
    }
    const last = playout.sample(60 * 33e6)!;
    expect([...last.coefficients]).toEqual([39, 78, 117]);
    for (const [n, { pose, coefficients }] of frames.entries()) {
      expect(pose[4]).toBe(n);
      expect([...coefficients]).toEqual([n, 2 * n, 3 * n]);
    }
  });

  it("keeps no more frames than it has a use for while nobody samples", () => {
    const playout = new Playout();
    for (let n = 0; n < 1000; ++n) playout.push(frameAt(n), n * 33e6, n * 33e6);
    expect(playout.droppedCount).toBe(1000 - 256);
  });
});

// One node, whose x, y and z are a mode each: displacements are coefficients.
const oneNode: HairBasis = {
  geometry: { ...fullGrid([2, 2, 2]), activeNodes: Uint32Array.of(0) },
  basis: {
    nodeCount: 1,
    deviationM: Float32Array.of(0.05, 0.05, 0.05),
    unit: new Float32Array(3).fill(1),
    modes: Int16Array.of(1, 0, 0, 0, 1, 0, 0, 0, 1),
  },
  skin: [],
};

/** Hair that swings as hair does: up to 2.4 Hz. */
function motionAt(timeNs: number): [number, number, number] {
  const t = 1e-9 * timeNs;
  const sum = (phase: number) =>
    0.04 * Math.sin(2 * Math.PI * 0.7 * t + phase) +
    0.02 * Math.sin(2 * Math.PI * 1.3 * t + 2 * phase) +
    0.01 * Math.sin(2 * Math.PI * 2.4 * t + 5 * phase);
  return [sum(0.3), sum(1.1), sum(2.3)];
}

/**
 * RMS over time of what is shown less the motion at the shown time, over the motion's RMS. Frames of 30 Hz take 20 ms
 * and up to `jitterNs` more, and arrive in order; `isLost` says which do not arrive; `noiseM`: of each coefficient,
 * evenly.
 */
function playedOut(isLost: (random: number) => boolean, jitterNs: number, noiseM = 0): number {
  const playout = new Playout();
  const kTickNs = 1e9 / 30;
  let arrivalNs = 0;
  let tick = 0;
  let errors = 0;
  let sizes = 0;
  for (let nowNs = 1e9; nowNs < 121e9; nowNs += 1e9 / 72) {
    for (;;) {
      const sampleNs = Math.round(tick * kTickNs);
      const draw = seeded(tick); // the same for a tick, however often it is looked at
      const [late, loss, ...noise] = Array.from({ length: 5 }, draw);
      arrivalNs = Math.max(arrivalNs, sampleNs + 20e6 + late * jitterNs);
      if (arrivalNs > nowNs) break;
      const coefficients = Float32Array.from(motionAt(sampleNs), (x, k) => x + noiseM * (noise[k] - 0.5));
      if (!isLost(loss)) playout.push(frameOf({ coefficients, basis: oneNode }), sampleNs, arrivalNs);
      ++tick;
    }
    const sample = playout.sample(nowNs);
    if (nowNs < 3e9) continue; // the delay settles
    const wanted = motionAt(sample!.timeNs);
    const displacement = displacementOf(sample!);
    for (let axis = 0; axis < 3; ++axis) {
      errors += (displacement[axis] - wanted[axis]) ** 2;
      sizes += wanted[axis] ** 2;
    }
  }
  return Math.sqrt(errors / sizes);
}

describe("play-out of a smooth motion", () => {
  const kJitterNs = 10e6;
  const kNoiseM = 0.001;

  it("errs by less than 0.2 % of it when all frames arrive, and by hardly more than frames do", () => {
    expect(playedOut(() => false, kJitterNs)).toBeLessThan(0.002);
    expect(playedOut(() => false, kJitterNs, kNoiseM)).toBeLessThan(0.01);
  });

  it("errs by less than 2.5 % of it when one frame in five is lost", () => {
    expect(playedOut((random) => random < 0.2, kJitterNs, kNoiseM)).toBeLessThan(0.025);
  });
});
