import { expect, test } from "vitest";
import type { HairBasis } from "../src/hair/basis";
import type { Frame } from "../src/hair/frame";
import { LearntState, makeLearntHair, stepLearnt } from "../src/hair/learntHair";
import { LevelIndex } from "../src/hair/level";
import { Playout } from "../src/hair/playout";
import { rigidPose } from "../src/hair/pose";
import { kPoseInputCount } from "../src/hair/poseInputs";
import { CoefficientCode } from "../src/net/codec/coefficientCode";
import { decodeFrame } from "../src/net/codec/frame";
import { hashGroom } from "../src/net/groomHash";
import type { CodedFrame, CodedFrameBatch } from "../src/net/messages";
import { learntVectors } from "./support/learntVectors";
import { LinkCoreDriver } from "./support/linkCoreDriver";
import { announced, basisData, batch, groom, joined } from "./support/memberFrames";
import { serverPacket } from "./support/serverPacket";
import { fromHex, vectors } from "./support/vectors";

// What characters cost a browser beside drawing: `npm run bench`. Times of one thread, in us a character.

const kCounts = [1, 32, 500];
const kTickNs = 1e9 / 30;
const kPicturesATick = 3;
const kModes = 256;
/** that a frame has */
const kSent = 100;
const kHidden = 48;

/** The mean time of `run`, µs a character, after a while to warm up. */
function timeOf(count: number, run: (tick: number) => number): number {
  const rounds = Math.max(60, Math.ceil(20_000 / count));
  let ms = 0;
  for (let round = 0; round < rounds; ++round) {
    const taken = run(round);
    if (round >= rounds / 2) ms += taken;
  }
  return (1000 * ms) / (rounds - Math.ceil(rounds / 2)) / count;
}

function timed(work: () => void): number {
  const begun = performance.now();
  work();
  return performance.now() - begun;
}

/** A link with `count` members whose basis and learnt hair are here. */
class Crowd {
  readonly #driver = new LinkCoreDriver();
  readonly #count: number;
  #tick = 100;

  constructor(count: number) {
    this.#count = count;
    const driver = this.#driver;
    driver.join();
    for (let i = 0; i < count; ++i) driver.tell({ ...joined, member: 300 + i, character: 1 + i });
    driver.tell(announced);
    driver.tell(this.#frames({}));
    driver.tell(basisData);
    const file = fromHex(learntVectors.file);
    driver.tell({ type: "groomLearnt", groom, learnt: hashGroom(file) });
    driver.tell(this.#frames({ level: LevelIndex.learnt }));
    driver.tell({ type: "groomData", hash: hashGroom(file), byteCount: file.length, offset: 0, bytes: file });
    for (let tick = 0; tick < 70; ++tick) driver.tell(this.#frames({ level: LevelIndex.learnt }));
    driver.events();
  }

  /** Takes a packet of one frame of each; returns ms. */
  take(more: Partial<CodedFrame>): number {
    const { core, nowNs, serverAheadNs } = this.#driver;
    const packet = serverPacket(nowNs + serverAheadNs, this.#frames(more));
    return timed(() => {
      core.onPacket(packet, nowNs);
      this.#driver.events();
    });
  }

  get undecodable(): number {
    return this.#driver.core.counters.framesUndecodable;
  }

  #frames(more: Partial<CodedFrame>): CodedFrameBatch {
    const tick = ++this.#tick;
    const frames = Array.from({ length: this.#count }, (_, i) => ({
      ...batch((tick + i) % 16, more).frames[0],
      member: 300 + i,
    }));
    return { ...batch(0, more, tick), frames };
  }
}

/** The bytes of the pose of a frame, as servers send them for learnt hair. */
function poseOf(content: Uint8Array): Uint8Array {
  let count = 1;
  while (!decodeFrame(content.subarray(0, count), null)) ++count;
  return content.slice(0, count);
}

/** Decodes frames of 70 to 110 bytes, with up to 96 coefficients. */
function timeDecoding(): number {
  const { deviations, frames } = vectors<{ deviations: number[][]; frames: { code: number; bytes: string }[] }>(
    "frame.json",
  );
  const code = new CoefficientCode(Float32Array.from(deviations[0]));
  const usual = frames.filter((each) => each.code === 0).map((each) => fromHex(each.bytes));
  const sent = usual.filter(({ length }) => length >= 70 && length <= 110);
  return timeOf(sent.length, () =>
    timed(() => {
      for (const bytes of sent) decodeFrame(bytes, code);
    }),
  );
}

function timeLink(count: number, more: Partial<CodedFrame>): number {
  const crowd = new Crowd(count);
  const time = timeOf(count, () => crowd.take(more));
  expect(crowd.undecodable).toBe(0);
  return time;
}

function timeNetwork(count: number): number {
  const weights = (length: number) => Float32Array.from({ length }, (_, i) => 0.2 * Math.sin(i));
  const gates = 3 * kHidden;
  const hair = makeLearntHair({
    hiddenCount: kHidden,
    modeCount: 32,
    inputWeights: weights(gates * kPoseInputCount),
    hiddenWeights: weights(gates * kHidden),
    bias: weights(gates),
    outputWeights: weights(32 * kHidden),
    most: new Float32Array(kPoseInputCount).fill(1),
    error: 0.4,
    lowError: 0.6,
  });
  const states = Array.from({ length: count }, () => new LearntState(hair));
  const out = new Float32Array(32);
  const pose = rigidPose();
  return timeOf(count, (tick) => {
    pose[4] = 0.01 * tick;
    return timed(() => {
      for (const state of states) stepLearnt(hair, state, pose, out);
    });
  });
}

/** Of a frame that comes, and of a picture. */
function timePlayout(count: number): [number, number] {
  const basis = { basis: { unit: new Float32Array(kModes) } } as HairBasis;
  const playouts = Array.from({ length: count }, () => new Playout());
  const frameAt = (at: number): Frame => ({
    member: 300,
    character: 0,
    level: LevelIndex.low,
    discontinuous: false,
    asleep: false,
    repeated: false,
    lastKnown: false,
    stepStride: 1,
    stepS: 1e-9 * kTickNs,
    pose: rigidPose([0, 0, 0, 1], [0.01 * at, 0, 0]),
    coefficients: Float32Array.from({ length: kModes }, (_, k) => (k < kSent ? Math.sin(at + k) : 0)),
    basis,
  });
  const picturesMs: number[] = [];
  let tick = 0;
  const push = timeOf(count, () => {
    const sampledNs = ++tick * kTickNs;
    const frames = playouts.map(() => frameAt(tick));
    const ms = timed(() => {
      for (const [i, playout] of playouts.entries()) playout.push(frames[i], sampledNs, sampledNs + 20e6);
    });
    picturesMs.push(
      timed(() => {
        for (let picture = 0; picture < kPicturesATick; ++picture)
          for (const playout of playouts) playout.sample(sampledNs + 20e6 + (picture * kTickNs) / kPicturesATick);
      }),
    );
    return ms;
  });
  const warm = picturesMs.slice(picturesMs.length / 2);
  const ms = warm.reduce((sum, each) => sum + each, 0) / warm.length;
  return [push, (1000 * ms) / (kPicturesATick * count)];
}

test("a crowd", () => {
  const learnt = { level: LevelIndex.learnt, evaluated: true, content: poseOf(batch(1).frames[0].content) };
  const rows = kCounts.map((characters) => {
    const [push, picture] = timePlayout(characters);
    return {
      characters,
      "frame of 6 coefficients": timeLink(characters, { level: LevelIndex.low }).toFixed(1),
      "frame of a pose, network of 20": timeLink(characters, learnt).toFixed(1),
      "network of 48": timeNetwork(characters).toFixed(1),
      "decoding 96 coefficients": timeDecoding().toFixed(1),
      "frame into play-out": push.toFixed(1),
      picture: picture.toFixed(1),
    };
  });
  // biome-ignore lint/suspicious/noConsole: what a benchmark is for
  console.table(rows);
});
