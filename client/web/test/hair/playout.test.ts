import { describe, expect, it } from "vitest";
import { kLatticeLayersMax } from "../../src/generated/constants";
import { Deformer } from "../../src/hair/deform";
import type { Frame } from "../../src/hair/frame";
import type { LatticeLayer } from "../../src/hair/latticeBlend";
import { LatticeBlend } from "../../src/hair/latticeBlend";
import type { LevelGeometry } from "../../src/hair/lattice";
import { ErrorClass, LevelIndex } from "../../src/hair/level";
import type { PlayoutSample } from "../../src/hair/playout";
import { Playout } from "../../src/hair/playout";
import { rigidPose } from "../../src/hair/pose";
import type { GeometryVector } from "../support/shapes";
import { fullGrid, geometryOf } from "../support/shapes";
import { furthest, vectors } from "../support/vectors";

interface PushedFrame {
  level: number;
  errorClass: number;
  discontinuous: boolean;
  asleep: boolean;
  stepS: number;
  pose: number[];
  displacements: number[];
  velocities: number[];
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
  blended: number[];
  droppedCount: number;
}
type Step = PushStep | SampleStep | { freeze: true };
interface PlayoutVector {
  name: string;
  levels: GeometryVector[];
  points: number[];
  steps: Step[];
}

function frameOf(pushed: PushedFrame, levels: LevelGeometry[]): Frame {
  return {
    ...pushed,
    member: 1,
    character: 0,
    lastKnown: false,
    stepStride: 1,
    pose: Float64Array.from(pushed.pose),
    displacements: Int16Array.from(pushed.displacements),
    velocities: Int16Array.from(pushed.velocities),
    geometry: pushed.level === LevelIndex.rigid ? null : levels[pushed.level],
  };
}

/** The effect of layers on points: the sum that shaders draw. */
function blended(points: Float32Array, layers: readonly LatticeLayer[]): Float32Array {
  const sum = Float64Array.from(points);
  const out = { points: new Float32Array(points.length) };
  for (const layer of layers) {
    new Deformer(layer.geometry.lattice, points, null, "quadratic").deform(layer.grid, out);
    for (let i = 0; i < sum.length; ++i) sum[i] += layer.weight * (out.points[i] - points[i]);
  }
  return Float32Array.from(sum);
}

describe("play-out", () => {
  for (const scene of vectors<PlayoutVector[]>("playout.json")) {
    it(`shows ${scene.name} as the C++ client does`, () => {
      const levels = scene.levels.map(geometryOf);
      const points = Float32Array.from(scene.points);
      const playout = new Playout();
      const blend = new LatticeBlend();
      for (const step of scene.steps) {
        if ("freeze" in step) playout.freeze();
        else if ("push" in step) playout.push(frameOf(step.push, levels), step.sampleTimeNs, step.arrivalTimeNs);
        else {
          const sample = playout.sample(step.sample);
          expect(sample !== null).toBe(step.valid);
          if (!sample) continue;
          expect(Math.abs(sample.timeNs - step.timeNs)).toBeLessThan(2);
          expect(Math.abs(playout.delayNs - step.delayNs)).toBeLessThan(2);
          expect(sample.level).toBe(step.level);
          expect(furthest(sample.pose, step.pose)).toBeLessThan(1e-6);
          expect(furthest(sample.displacement, step.displacement)).toBeLessThan(1e-6);
          expect(furthest(blended(points, blend.update(sample)), step.blended)).toBeLessThan(2e-6);
          expect(playout.droppedCount).toBe(step.droppedCount);
        }
      }
    });
  }

  const frameAt = (x: number, asleep = false): Frame => ({
    member: 1,
    character: 0,
    level: LevelIndex.rigid,
    errorClass: ErrorClass.halfMm,
    discontinuous: false,
    asleep,
    lastKnown: false,
    stepStride: 1,
    stepS: 1 / 30,
    pose: rigidPose([0, 0, 0, 1], [x, 0, 0]),
    displacements: new Int16Array(0),
    velocities: new Int16Array(0),
    geometry: null,
  });

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

  it("keeps no more frames than it has a use for while nobody samples", () => {
    const playout = new Playout();
    for (let n = 0; n < 1000; ++n) playout.push(frameAt(n), n * 33e6, n * 33e6);
    expect(playout.droppedCount).toBe(1000 - 256);
  });
});

describe("switches of level", () => {
  const geometries = [fullGrid([4, 4, 4]), fullGrid([3, 3, 3], 0.15)];
  const sampleAt = (level: LevelIndex, timeNs: number, size: number): PlayoutSample => ({
    pose: rigidPose(),
    level,
    displacement:
      level === LevelIndex.rigid
        ? new Float32Array(0)
        : Float32Array.from({ length: 3 * geometries[level].activeNodes.length }, (_, i) => size * Math.sin(i + level)),
    timeNs,
    geometry: level === LevelIndex.rigid ? null : geometries[level],
  });
  const points = Float32Array.from({ length: 60 }, (_, i) => 0.15 + 0.1 * Math.sin(3 * i));

  it("stay within the layers there are, and leave out the weakest alone, however many follow each other", () => {
    const shapes = [0, 1, 4].map((each) => blended(points, new LatticeBlend().update(sampleAt(each, 0, 0.01))));
    const apart = Math.max(...shapes.flatMap((a) => shapes.map((b) => furthest(a, b))));
    const blend = new LatticeBlend();
    let level = 0;
    let timeNs = 0;
    blend.update(sampleAt(level, 0, 0.01));
    for (const next of [1, 0, 4, 1, 0, 4, 0, 1]) {
      timeNs += 150e6; // each before the previous one has faded
      const before = blended(points, blend.update(sampleAt(level, timeNs, 0.01)));
      const layers = blend.update(sampleAt(next, timeNs, 0.01));
      expect(layers.length).toBeLessThanOrEqual(kLatticeLayersMax);
      // The rest of a switch after two more, 150 ms each: 0.68 of 0.68.
      expect(furthest(blended(points, layers), before)).toBeLessThan(0.48 * apart);
      level = next;
    }
    // After all fades only the newest is left.
    expect(blend.update(sampleAt(1, timeNs + 399e6, 0.01)).length).toBeGreaterThan(1);
    expect(blend.update(sampleAt(1, timeNs + 401e6, 0.01)).length).toBe(1);
  });

  it("leave hair in place at the moment of the switch", () => {
    const blend = new LatticeBlend();
    let shown = blended(points, blend.update(sampleAt(0, 0, 0.01)));
    for (const [n, level] of [1, 4, 0].entries()) {
      const layers = blend.update(sampleAt(level, (n + 1) * 600e6, 0.01));
      const after = blended(points, layers);
      expect(furthest(after, shown)).toBeLessThan(1e-6);
      blend.update(sampleAt(level, (n + 1) * 600e6 + 500e6, 0.01));
      shown = blended(points, blend.update(sampleAt(level, (n + 1) * 600e6 + 550e6, 0.01)));
    }
  });

  it("keep their sum of weights at what is lost by the fade alone", () => {
    const blend = new LatticeBlend();
    blend.update(sampleAt(0, 0, 0.01));
    for (let t = 0; t <= 40; ++t) {
      const layers = blend.update(sampleAt(1, 1e9 + t * 10e6, 0.01));
      const weights = layers.map((layer) => layer.weight);
      expect(weights[0]).toBe(1);
      const gone = t / 40;
      const left = 1 - gone * gone * (3 - 2 * gone);
      if (left > 0) {
        expect(weights[1]).toBeCloseTo(left, 9);
        expect(weights[2]).toBeCloseTo(-left, 9);
      } else {
        expect(weights.length).toBe(1);
      }
    }
  });

  it("leave nothing of the old one where a level is built otherwise", () => {
    const blend = new LatticeBlend();
    blend.update(sampleAt(0, 0, 0.01));
    expect(blend.update({ ...sampleAt(0, 1e6, 0.01), geometry: fullGrid([4, 4, 4], 0.2) }).length).toBe(1);
  });

  it("are shown as they are where the caller marks the hair as discontinuous", () => {
    const blend = new LatticeBlend();
    blend.update(sampleAt(0, 0, 0.01));
    expect(blend.update(sampleAt(1, 1e6, 0.01), true).length).toBe(1);
  });
});
