import { describe, expect, it } from "vitest";
import { LevelIndex } from "../../src/hair/level";
import type * as m from "../../src/net/messages";
import { ErrorReason, GoodbyeReason, GroomState, ModerateAction, ObserveMode } from "../../src/net/messages";
import { kObserveAll } from "../../src/net/roomMessages";
import { LinkCoreDriver, addCharacter, kSecond } from "../support/linkCoreDriver";
import { announced, batch, framesOf, giveBasis, groom, joined, sequence } from "../support/memberFrames";
import { rigidContent } from "../support/rigidContent";
import { furthest } from "../support/vectors";

describe("link: coming back", () => {
  const file = new Uint8Array(100).fill(1);

  function withCharacter(): { driver: LinkCoreDriver; hash: string } {
    const driver = new LinkCoreDriver();
    driver.join();
    const hash = driver.core.offerGroom(file);
    driver.core.send(addCharacter(7, hash, LevelIndex.low));
    driver.core.send({ ...kObserveAll, mode: ObserveMode.nearest, count: 5 });
    driver.sent();
    driver.tell({ type: "groomStatus", hash, state: GroomState.ready });
    driver.tell({ type: "characterAdded", character: 7, groom: hash, level: LevelIndex.rigid, member: 300 });
    giveBasis(driver, hash);
    sequence.contents.forEach((_, n) => {
      driver.tell(batch(n));
    });
    driver.events();
    return { driver, hash };
  }

  it("waits, then names its session, and says nothing again that a server still knows", () => {
    const { driver } = withCharacter();
    driver.break();
    expect(driver.events()).toMatchObject([{ type: "reconnecting", detail: "the line is dead" }]);
    expect(driver.core.wantsConnection).toBe(false);
    driver.pass(6 * kSecond);
    expect(driver.open()).toMatchObject({ type: "hello", session: 77n });
    driver.tell(driver.welcome({ resumed: true }));
    const said = driver.sent().map((message) => message.type);
    expect(said).toEqual(["setLevel", "observe"]);
    expect(driver.core.counters).toMatchObject({ reconnects: 1, resumes: 1 });
  });

  it("brings its token again when it resumes", () => {
    const driver = new LinkCoreDriver({ token: "a.b.c" });
    expect(driver.open()).toMatchObject({ type: "hello", token: "a.b.c", session: 0n });
    driver.tell(driver.welcome());
    driver.break();
    driver.pass(6 * kSecond);
    expect(driver.open()).toMatchObject({ type: "hello", token: "a.b.c", session: 77n });
  });

  it("tries a resume again that came too early", () => {
    const { driver } = withCharacter();
    driver.break();
    driver.pass(6 * kSecond);
    driver.open();
    driver.events();
    driver.tell({ type: "goodbye", reason: GoodbyeReason.overRate, detail: "resumed a moment ago" });
    expect(driver.events()).toMatchObject([{ type: "reconnecting", reason: GoodbyeReason.overRate }]);
    driver.break();
    driver.pass(12 * kSecond);
    expect(driver.open()).toMatchObject({ type: "hello", session: 77n });
    driver.tell(driver.welcome({ resumed: true }));
    expect(driver.core.counters).toMatchObject({ reconnects: 1, resumes: 1 });
  });

  it("tells a server that has lost the session everything, with the hair as it was", () => {
    const { driver, hash } = withCharacter();
    const setWind = (gustRatio: number): m.SetWind => ({
      type: "setWind",
      wind: {
        meanMPerS: [1, 0, 0],
        gustRatio,
        gustPeriodS: 4,
        turbulenceRmsMPerS: 0,
        turbulenceScaleM: 0.6,
        seed: 1n,
      },
    });
    for (const gustRatio of [0, 0.5]) driver.core.send(setWind(gustRatio));
    const scale = { stiffness: 2, damping: 1, density: 1, etherDamping: 1, airDrag: 1, gelPerS2: 0 };
    driver.core.send({ type: "setMaterial", character: 7, scale });
    driver.break();
    const said = driver.rejoin();
    const types = said.map((message) => message.type);
    expect(types).toEqual(["groomOffer", "addCharacter", "setMaterial", "setWind", "observe"]);
    expect(said[2]).toMatchObject({ character: 7, scale });
    expect(said[3]).toEqual(setWind(0.5));
    const added = said[1] as m.AddCharacter;
    expect(added).toMatchObject({ character: 7, groom: hash, level: LevelIndex.low });
    const { stepM, displacements, velocities } = added.state!;
    expect(stepM).toBe(sequence.state.stepM);
    // Numbers between two integers may be rounded to either.
    expect(furthest(displacements, sequence.state.displacements)).toBeLessThanOrEqual(1);
    expect(furthest(velocities, sequence.state.velocities)).toBeLessThanOrEqual(1);
    expect(Math.max(...velocities)).toBeGreaterThan(10);
  });

  it("gives hair no velocity when there is no frame shortly before the last", () => {
    const { driver } = withCharacter();
    driver.tell(batch(0, {}, 300));
    driver.break();
    const added = driver.rejoin().find((message) => message.type === "addCharacter") as m.AddCharacter;
    expect(added.state!.displacements.length).toBe(sequence.state.displacements.length);
    expect(added.state!.velocities.length).toBe(0);
  });

  it("does not repeat a moderation over a new connection", () => {
    const { driver } = withCharacter();
    const action = ModerateAction.lock;
    driver.core.send({ type: "moderate", action, session: 0n, subject: "", seconds: 0, reason: "" });
    expect(driver.sent().map((message) => message.type)).toContain("moderate");
    driver.break();
    expect(driver.rejoin().map((message) => message.type)).not.toContain("moderate");
  });

  it("shows the kept hair while the new server has none of it, and no longer", () => {
    const { driver, hash } = withCharacter();
    driver.break();
    driver.rejoin();
    driver.tell({ type: "characterAdded", character: 7, groom: hash, level: LevelIndex.rigid, member: 4 });
    const rigid = { member: 4, level: LevelIndex.rigid, content: rigidContent() };
    driver.events();
    driver.tell(batch(0, rigid, 5));
    const [kept] = framesOf(driver.events());
    expect(kept).toMatchObject({ lastKnown: true, level: LevelIndex.rigid });
    expect(Array.from(kept.coefficients)).toEqual(sequence.coefficients.at(-1));
    driver.tell({ ...announced, groom: hash });
    driver.tell(batch(0, { member: 4 }, 6));
    // The same basis: its hair goes on from there.
    expect(framesOf(driver.events())[0].basis).toBe(kept.basis);
    driver.tell(batch(0, rigid, 7));
    expect(framesOf(driver.events())[0]).toMatchObject({ lastKnown: false, basis: null });
  });

  it("tells of members that have left meanwhile", () => {
    const driver = new LinkCoreDriver();
    driver.join();
    driver.tell(joined);
    driver.tell({ ...joined, member: 301, character: 2 });
    driver.break();
    driver.events();
    driver.rejoin({ resumed: true });
    driver.tell(joined);
    driver.pass(1.1 * kSecond);
    expect(driver.events().filter((event) => event.type.startsWith("member"))).toEqual([
      { type: "memberLeft", member: 301 },
    ]);
  });

  it("comes back ever more rarely to a server that stays away, and gives up when it is to", () => {
    const driver = new LinkCoreDriver({ giveUpAfterS: 20, random: () => 0.999 });
    driver.join();
    driver.break();
    let attempts = 0;
    while (!driver.core.hasEnded) {
      driver.pass(0.05 * kSecond);
      if (!driver.core.wantsConnection) continue;
      driver.core.onOpening(driver.nowNs);
      driver.core.onClosed("refused", driver.nowNs);
      ++attempts;
    }
    expect(attempts).toBeGreaterThan(4);
    expect(attempts).toBeLessThan(20);
    expect(driver.events().at(-1)).toMatchObject({ type: "disconnected", detail: "gave up reconnecting" });
  });

  it("does not come back after a goodbye that would be said again", () => {
    for (const [reason, ends] of [
      [GoodbyeReason.tokenRefused, true],
      [GoodbyeReason.sessionTakenOver, true],
      [GoodbyeReason.removed, true],
      [GoodbyeReason.serverDraining, false],
      [GoodbyeReason.slowConsumer, false],
    ] as const) {
      const driver = new LinkCoreDriver();
      driver.join();
      driver.tell({ type: "goodbye", reason, detail: "so it is" });
      expect(driver.core.hasEnded).toBe(ends);
      expect(driver.core.wantsClose).toBe(true);
    }
  });

  it("overlooks errors that only say that something arrived twice", () => {
    const driver = new LinkCoreDriver();
    driver.join();
    driver.core.send(addCharacter(7, groom));
    driver.sent();
    driver.break();
    const said = driver.rejoin({ resumed: true });
    expect(said.map((message) => message.type)).toContain("addCharacter");
    driver.events();
    const exists: m.ErrorMessage = {
      type: "error",
      reason: ErrorReason.characterExists,
      character: 7,
      groom: null,
      detail: "",
    };
    driver.tell(exists);
    expect(driver.events()).toEqual([]);
    driver.tell(exists);
    expect(driver.eventTypes()).toEqual(["error"]);
  });

  it("says goodbye, closes, and ends", () => {
    const driver = new LinkCoreDriver();
    driver.join();
    driver.core.leave(driver.nowNs);
    expect(driver.sent()).toMatchObject([{ type: "goodbye", reason: GoodbyeReason.clientLeaves }]);
    expect(driver.core.wantsClose).toBe(true);
    driver.break("");
    expect(driver.core.hasEnded).toBe(true);
    expect(driver.events().at(-1)).toMatchObject({ type: "disconnected", reason: GoodbyeReason.clientLeaves });
  });
});
