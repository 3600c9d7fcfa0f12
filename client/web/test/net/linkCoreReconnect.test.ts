import { describe, expect, it } from "vitest";
import { LevelIndex } from "../../src/hair/level";
import { rigidPose } from "../../src/hair/pose";
import type * as m from "../../src/net/messages";
import { ErrorReason, GoodbyeReason, GroomState, ModerateAction, ObserveMode } from "../../src/net/messages";
import { kObserveAll } from "../../src/net/roomMessages";
import { LinkCoreDriver, addCharacter, kSecond } from "../support/linkCoreDriver";
import { announced, batch, framesOf, giveBasis, groom, joined, sequence } from "../support/memberFrames";
import { rigidContent } from "../support/rigidContent";
import { furthest } from "../support/vectors";

describe("link: coming back", () => {
  const file = new Uint8Array(100).fill(1);

  const windOf = (gustRatio: number): m.SetWind => ({
    type: "setWind",
    wind: {
      meanMPerS: [1, 0, 0],
      gustRatio,
      gustPeriodS: 4,
      turbulenceRmsMPerS: 0,
      turbulenceScaleM: 0.6,
      seed: 1n,
      carried: false,
    },
  });

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

  it("follows a redirect at once, with a new session and the hair as it was", () => {
    const { driver } = withCharacter();
    driver.tell({ type: "redirect", to: { host: "hair-2", port: 7421 } });
    expect(driver.events()).toMatchObject([{ detail: "the room is held by hair-2, port 7421", waitS: 0 }]);
    expect(driver.core.wantsClose).toBe(true);
    driver.break();
    expect(driver.core.redirectedTo).toMatchObject({ host: "hair-2", port: 7421 });
    expect(driver.open()).toMatchObject({ type: "hello", session: 0n, redirects: 1 });
    driver.tell(driver.welcome({ session: 78n }));
    const added = driver.sent().find((message) => message.type === "addCharacter");
    expect(added?.state).not.toBeNull();
    driver.break();
    driver.pass(6 * kSecond);
    expect(driver.open()).toMatchObject({ type: "hello", session: 78n, redirects: 0 });
    expect(driver.core.counters).toMatchObject({ redirects: 1 });
  });

  it("goes on over a better connection at once, with its session", () => {
    const { driver } = withCharacter();
    expect(driver.core.replaceConnection("a better one", driver.nowNs)).toBe(true);
    expect(driver.events()).toMatchObject([{ type: "reconnecting", detail: "a better one", waitS: 0 }]);
    expect(driver.core.replaceConnection("one more", driver.nowNs)).toBe(false);
    expect(driver.core.wantsClose).toBe(true);
    driver.break();
    expect(driver.open()).toMatchObject({ type: "hello", session: 77n, redirects: 0 });
    driver.tell(driver.welcome({ resumed: true }));
    expect(driver.sent().map((message) => message.type)).toEqual(["setLevel", "observe"]);
    expect(driver.core.isActive).toBe(true);
  });

  it("keeps a connection that works when it may not reconnect", () => {
    const driver = new LinkCoreDriver({ reconnect: false });
    driver.join();
    expect(driver.core.replaceConnection("a better one", driver.nowNs)).toBe(false);
    expect(driver.core.isActive).toBe(true);
  });

  it("asks the first server again where the named one does not answer", () => {
    const { driver } = withCharacter();
    driver.tell({ type: "redirect", to: { host: "hair-2", port: 7421 } });
    driver.break();
    driver.core.onOpening(driver.nowNs);
    driver.break();
    expect(driver.core.redirectedTo).toBeNull();
    driver.pass(6 * kSecond);
    expect(driver.open()).toMatchObject({ type: "hello", session: 77n });
  });

  it("asks those that the server has named where nobody else answers", () => {
    const driver = new LinkCoreDriver();
    driver.join({ others: [{ host: "hair-2", port: 7421 }] });
    driver.break();
    const asked: string[] = [];
    for (let i = 0; i < 4; ++i) {
      driver.pass(1);
      asked.push(`${driver.core.redirectedTo?.host ?? "first"}, ${driver.core.wantsConnection ? "at once" : "later"}`);
      driver.pass(12 * kSecond);
      driver.core.onOpening(driver.nowNs);
      driver.break();
    }
    expect(asked).toEqual(["first, later", "first, later", "hair-2, at once", "first, later"]);
  });

  it("leaves servers that send it on and on", () => {
    const { driver } = withCharacter();
    for (let port = 1; port <= 5; ++port) {
      driver.tell({ type: "redirect", to: { host: "hair", port } });
      driver.break();
      if (port < 5) expect(driver.open()).toMatchObject({ type: "hello", redirects: port });
    }
    expect(driver.core.wantsConnection).toBe(false);
    expect(driver.core.redirectedTo).toBeNull();
    expect(driver.core.counters).toMatchObject({ redirectLoops: 1 });
  });

  /** Asks the first server; is sent to hair-2, which has died. False once the link has ended. */
  function askInVain(driver: LinkCoreDriver): boolean {
    while (!driver.core.wantsConnection && !driver.core.hasEnded) driver.pass(kSecond / 10);
    if (driver.core.hasEnded) return false;
    expect(driver.core.redirectedTo).toBeNull();
    expect(driver.open()).toSatisfy((hello: m.Message) => hello.type === "hello" && hello.redirects < 2);
    driver.tell({ type: "redirect", to: { host: "hair-2", port: 7421 } });
    driver.break();
    driver.core.onOpening(driver.nowNs);
    driver.break();
    return !driver.core.hasEnded;
  }

  it("asks the first server until it takes the room of a server that has died", () => {
    const driver = new LinkCoreDriver();
    const beginNs = driver.nowNs;
    while (driver.nowNs - beginNs < 20 * kSecond) expect(askInVain(driver)).toBe(true);
    while (!driver.core.wantsConnection) driver.pass(kSecond / 10);
    driver.open();
    driver.tell(driver.welcome());
    expect(driver.core.isActive).toBe(true);
    expect(driver.core.counters).toMatchObject({ redirectLoops: 0 });
  });

  it("ends when nobody takes that room", () => {
    const driver = new LinkCoreDriver();
    const beginNs = driver.nowNs;
    while (askInVain(driver));
    expect(driver.nowNs - beginNs).toBeGreaterThanOrEqual(30 * kSecond);
    expect(driver.nowNs - beginNs).toBeLessThan(40 * kSecond);
    expect(driver.core.endDetail).toBe("the line is dead");
  });

  it("ends a first connection to servers that contradict each other with that reason", () => {
    const driver = new LinkCoreDriver();
    for (let turn = 0; !driver.core.hasEnded; ++turn) {
      while (!driver.core.wantsConnection) driver.pass(kSecond / 10);
      driver.open();
      driver.tell({ type: "redirect", to: { host: turn % 2 ? "hair-1" : "hair-2", port: 7420 } });
      if (!driver.core.hasEnded) driver.break();
    }
    expect(driver.core.endDetail).toBe("the servers do not agree on who holds the room");
    expect(driver.core.counters.redirectLoops).toBeGreaterThan(1);
  });

  it("refuses a redirect to what is no address", () => {
    const { driver } = withCharacter();
    driver.tell({ type: "redirect", to: { host: "hair/../x", port: 7421 } });
    expect(driver.events()).toMatchObject([{ type: "disconnected", reason: GoodbyeReason.protocolError }]);
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

  it("leaves the wind that another client has set since", () => {
    for (const duringOutage of [false, true]) {
      const { driver } = withCharacter();
      driver.tell({ type: "roomWind", wind: windOf(0).wind, session: 0n });
      driver.core.send(windOf(0.5));
      driver.sent();
      driver.tell({ type: "roomWind", wind: windOf(0.5).wind, session: driver.core.welcome!.session });
      const anothers: m.ServerMessage = { type: "roomWind", wind: windOf(1).wind, session: 99n };
      if (!duringOutage) driver.tell(anothers);
      driver.break();
      const said = driver.rejoin();
      driver.tell(duringOutage ? anothers : { type: "roomWind", wind: windOf(0).wind, session: 0n });
      const types = [...said, ...driver.sent()].map((message) => message.type);
      expect(types).not.toContain("setWind");
    }
  });

  it("sets the wind that was asked for during the outage, or got lost in it, whoever has set one", () => {
    for (const duringOutage of [false, true]) {
      const { driver } = withCharacter();
      if (!duringOutage) driver.core.send(windOf(0.5));
      driver.break();
      if (duringOutage) driver.core.send(windOf(0.5));
      const said = driver.rejoin();
      driver.tell({ type: "roomWind", wind: windOf(1).wind, session: 99n });
      const winds = [...said, ...driver.sent()].filter((message) => message.type === "setWind");
      expect(winds).toEqual([windOf(0.5)]);
    }
  });

  it("tells a server that has lost the session everything, with the hair as it was", () => {
    const { driver, hash } = withCharacter();
    for (const gustRatio of [0, 0.5]) driver.core.send(windOf(gustRatio));
    const scale = { stiffness: 2, damping: 1, density: 1, etherDamping: 1, airDrag: 1, gelPerS2: 0 };
    driver.core.send({ type: "setMaterial", character: 7, scale });
    driver.break();
    const said = driver.rejoin();
    const types = said.map((message) => message.type);
    expect(types).toEqual(["groomOffer", "addCharacter", "setMaterial", "observe", "setWind"]);
    expect(said[4]).toEqual(windOf(0.5));
    expect(said[2]).toMatchObject({ character: 7, scale });
    driver.tell({ type: "roomWind", wind: windOf(0).wind, session: 0n });
    expect(driver.sent()).toEqual([]);
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

  it("brings another server the newest pose with the character", () => {
    const { driver } = withCharacter();
    const push = (number: number) =>
      driver.core.pushPoses([
        { character: 7, sequence: number, captureTimeNs: driver.nowNs, teleport: false, pose: rigidPose() },
      ]);
    const goOn = (waitNs: number) => {
      driver.tell({ type: "redirect", to: { host: "hair-2", port: 7421 } });
      driver.break();
      driver.pass(waitNs);
      return driver.join({ session: 78n }).filter((message) => message.type === "poseBatch");
    };
    push(1);
    push(2);
    driver.sent();
    expect(goOn(0.1 * kSecond)).toMatchObject([{ poses: [{ character: 7, sequence: 2 }] }]);
    push(3);
    driver.sent();
    expect(goOn(kSecond), "it is too old").toEqual([]);
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

  it("keeps the hair for the next server where the resumed session has brought no frame", () => {
    const { driver, hash } = withCharacter();
    driver.break();
    driver.rejoin({ resumed: true });
    driver.break();
    driver.rejoin({ session: 78n });
    driver.tell({ type: "characterAdded", character: 7, groom: hash, level: LevelIndex.rigid, member: 4 });
    driver.events();
    driver.tell(batch(0, { member: 4, level: LevelIndex.rigid, content: rigidContent() }, 5));
    expect(framesOf(driver.events())[0]).toMatchObject({ lastKnown: true });
  });

  it("shows the kept hair until a slow line has brought its basis", () => {
    const { driver, hash } = withCharacter();
    driver.break();
    driver.rejoin();
    driver.tell({ type: "characterAdded", character: 7, groom: hash, level: LevelIndex.rigid, member: 4 });
    driver.tell({ type: "groomStatus", hash, state: GroomState.ready });
    driver.pass(5 * kSecond);
    driver.events();
    driver.tell(batch(0, { member: 4 }, 5));
    expect(framesOf(driver.events())[0]).toMatchObject({ lastKnown: true });
  });

  it("gives the next server as long again for its lattice", () => {
    const { driver, hash } = withCharacter();
    const shows = (tick: number): boolean => {
      driver.tell({ type: "characterAdded", character: 7, groom: hash, level: LevelIndex.rigid, member: 4 });
      driver.events();
      driver.tell(batch(0, { member: 4, level: LevelIndex.rigid, content: rigidContent() }, tick));
      return framesOf(driver.events())[0].lastKnown;
    };
    driver.break();
    driver.rejoin();
    driver.tell({ type: "groomStatus", hash, state: GroomState.ready });
    expect(shows(4)).toBe(true);
    driver.pass(0.9 * kSecond);
    expect(shows(5)).toBe(true);
    driver.break();
    driver.rejoin({ session: 78n });
    driver.pass(0.5 * kSecond);
    expect(shows(6)).toBe(true);
    driver.tell({ type: "groomStatus", hash, state: GroomState.ready });
    expect(shows(7)).toBe(true);
    driver.pass(kSecond);
    expect(shows(8)).toBe(false);
    driver.break();
    driver.rejoin({ session: 79n });
    expect(shows(9)).toBe(false);
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
