import { describe, expect, it } from "vitest";
import { LevelIndex } from "../../src/hair/level";
import { hashGroom } from "../../src/net/groomHash";
import { ErrorReason, type GroomData, type GroomLearnt } from "../../src/net/messages";
import { learntVectors } from "../support/learntVectors";
import { LinkCoreDriver } from "../support/linkCoreDriver";
import { announced, batch, framesOf, giveBasis, groom, joined, sequence } from "../support/memberFrames";
import { fromHex, furthest } from "../support/vectors";

const file = fromHex(learntVectors.file);
const learnt = hashGroom(file);
const groomLearnt: GroomLearnt = { type: "groomLearnt", groom, learnt };
const data: GroomData = { type: "groomData", hash: learnt, byteCount: file.length, offset: 0, bytes: file };
const request = { type: "groomRequest", hash: learnt, offset: 0 };
const evaluate = { type: "evaluateLearnt", groom, learnt };

const coded = { level: LevelIndex.learnt };
const evaluated = { level: LevelIndex.learnt, evaluated: true };

/** A client that was told of learnt hair, and has the basis of the groom. */
function told(options = {}): LinkCoreDriver {
  const driver = new LinkCoreDriver(options);
  driver.join();
  driver.tell(joined);
  giveBasis(driver);
  driver.tell(groomLearnt);
  return driver;
}

function show(driver: LinkCoreDriver, n: number, more: object): Float32Array {
  driver.tell(batch(n, more));
  const frames = framesOf(driver.events());
  expect(frames).toHaveLength(1);
  return frames[0].coefficients;
}

describe("link: learnt hair", () => {
  it("asks for the network with the first learnt frame, and tells once that it evaluates", () => {
    const driver = told();
    show(driver, 1, {});
    expect(driver.sent()).toEqual([]);
    show(driver, 2, coded);
    expect(driver.sent()).toEqual([request]);
    driver.tell(data);
    show(driver, 3, coded);
    expect(driver.sent()).toEqual([evaluate]);
    show(driver, 4, coded);
    expect(driver.sent()).toEqual([]);
  });

  it("shows coefficients as they come, and goes on from them without", () => {
    const driver = told();
    show(driver, 1, coded);
    driver.tell(data);
    for (let n = 2; n < 8; ++n) expect(furthest(show(driver, n, coded), sequence.coefficients[n])).toBeLessThan(1e-6);
    const last = sequence.coefficients[7];
    const gone = show(driver, 8, evaluated);
    expect(furthest(gone, last)).toBeGreaterThan(0);
    expect(driver.core.counters).toMatchObject({ framesEvaluated: 1, framesLackingLearnt: 0 });
  });

  it("changes no frame that it has given out", () => {
    const driver = told();
    const given: { coefficients: Float32Array; copy: Float32Array }[] = [];
    const keep = (n: number, more: object) => {
      const coefficients = show(driver, n, more);
      given.push({ coefficients, copy: coefficients.slice() });
    };
    keep(1, coded);
    keep(2, evaluated);
    driver.tell(data);
    for (let n = 3; n < 15; ++n) keep(n, n % 3 === 0 ? coded : evaluated);
    for (const { coefficients, copy } of given) expect(coefficients).toEqual(copy);
  });

  it("keeps the last coefficients and counts when it cannot evaluate", () => {
    const driver = told();
    show(driver, 1, coded);
    expect(furthest(show(driver, 2, evaluated), sequence.coefficients[1])).toBeLessThan(1e-6);
    expect(furthest(show(driver, 3, evaluated), sequence.coefficients[1])).toBeLessThan(1e-6);
    expect(driver.core.counters).toMatchObject({ framesEvaluated: 0, framesLackingLearnt: 2 });
  });

  it("tells the server again when the network has missed too many frames, once until there are coefficients", () => {
    const driver = told();
    driver.tell(batch(1, coded));
    driver.tell(data);
    for (let tick = 102; tick < 160; ++tick) driver.tell(batch(tick % 16, coded, tick));
    driver.tell(batch(1, evaluated, 167));
    driver.sent();
    driver.tell(batch(1, evaluated, 175));
    expect(driver.sent()).toEqual([]);
    driver.tell(batch(2, evaluated, 184));
    expect(driver.sent()).toEqual([evaluate]);
    driver.tell(batch(3, evaluated, 185));
    expect(driver.sent()).toEqual([]);
    driver.tell(batch(4, coded, 186));
    driver.tell(batch(5, evaluated, 195));
    expect(driver.sent()).toEqual([evaluate]);
  });

  it("tells a server that resumes the session again", () => {
    const driver = told();
    show(driver, 1, coded);
    driver.tell(data);
    show(driver, 2, coded);
    driver.sent();
    driver.core.onClosed("the cable", driver.nowNs);
    driver.rejoin({ resumed: true });
    driver.tell(joined);
    driver.tell(announced);
    driver.tell(groomLearnt);
    driver.events();
    driver.sent();
    show(driver, 9, coded);
    expect(driver.sent()).toEqual([evaluate]);
  });

  it("says why a network cannot be used, once, and takes coefficients", () => {
    const driver = told();
    const spoilt = file.slice(0, file.length / 2);
    const hash = hashGroom(spoilt);
    driver.tell({ ...groomLearnt, learnt: hash });
    show(driver, 1, coded);
    driver.tell({ ...data, hash, byteCount: spoilt.length, bytes: spoilt });
    expect(driver.events()).toMatchObject([
      {
        type: "error",
        reason: ErrorReason.groomInvalid,
        groom,
        detail: expect.stringMatching(/^its learnt hair cannot be used: /),
      },
    ]);
    driver.sent();
    expect(furthest(show(driver, 2, coded), sequence.coefficients[2])).toBeLessThan(1e-6);
    expect(driver.sent()).toEqual([]);
  });

  it("does not bother the caller when the server refuses to leave the hair to the client", () => {
    const driver = told();
    show(driver, 1, coded);
    driver.tell(data);
    show(driver, 2, coded);
    driver.tell({ type: "error", reason: ErrorReason.groomUnavailable, character: 0, groom: learnt, detail: "no" });
    expect(driver.events()).toEqual([]);
  });

  it("neither downloads a network nor says that it evaluates when it shall not", () => {
    const driver = told({ evaluateLearnt: false });
    show(driver, 1, coded);
    expect(driver.sent()).toEqual([]);
  });
});
