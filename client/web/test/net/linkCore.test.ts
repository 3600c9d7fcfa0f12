import { describe, expect, it } from "vitest";
import { HairnetError } from "../../src/hair/hairnetError";
import { LevelIndex } from "../../src/hair/level";
import { rigidPose } from "../../src/hair/pose";
import { hashGroom } from "../../src/net/groomHash";
import { LinkCore } from "../../src/net/linkCore";
import type * as m from "../../src/net/messages";
import { ErrorReason, GoodbyeReason, GroomState } from "../../src/net/messages";
import { encodePacket } from "../../src/net/packet";
import { LinkCoreDriver, addCharacter, kSecond } from "../support/linkCoreDriver";
import { announced, basisData, batch, framesOf, giveBasis, groom, joined, sequence } from "../support/memberFrames";
import { rigidContent } from "../support/rigidContent";
import { serverPacket } from "../support/serverPacket";
import { fromHex, seeded, vectors } from "../support/vectors";

const pose = (character: number, sequenceNumber: number, teleport = false): m.PoseSample => ({
  character,
  sequence: sequenceNumber,
  captureTimeNs: 0,
  teleport,
  pose: rigidPose(),
});

describe("link: opening", () => {
  it("says hello and nothing more before the welcome", () => {
    const driver = new LinkCoreDriver({ clientName: "me", room: "hall" });
    driver.core.send(addCharacter(7, groom));
    const hello = driver.open();
    expect(hello).toMatchObject({ type: "hello", protocolVersion: 4, clientName: "me", room: "hall", session: 0n });
    expect(driver.sent()).toEqual([]);
  });

  it("says after the welcome what was asked for before", () => {
    const driver = new LinkCoreDriver();
    const file = new Uint8Array(1000);
    const hash = driver.core.offerGroom(file);
    driver.core.send(addCharacter(7, hash, LevelIndex.medium));
    driver.core.send({ type: "setLevel", character: 7, level: LevelIndex.low });
    const said = driver.join();
    expect(said[0]).toMatchObject({ type: "groomOffer", hash, byteCount: 1000 });
    expect(said[1]).toMatchObject({ type: "addCharacter", character: 7, groom: hash, level: LevelIndex.low });
    expect(driver.eventTypes()).toEqual(["connected"]);
  });

  it("ends when the first attempt fails, and says why", () => {
    const driver = new LinkCoreDriver();
    driver.open();
    driver.break("no such host");
    expect(driver.core.hasEnded).toBe(true);
    expect(driver.core.endDetail).toBe("no such host");
    expect(driver.eventTypes()).toEqual(["disconnected"]);
  });

  it("gives up on a server that does not welcome it in time", () => {
    const driver = new LinkCoreDriver();
    driver.open();
    driver.pass(4.9 * kSecond);
    expect(driver.core.hasEnded).toBe(false);
    driver.pass(0.2 * kSecond);
    expect(driver.core.hasEnded).toBe(true);
  });

  it("ends with a server that does not begin with a welcome", () => {
    const driver = new LinkCoreDriver();
    driver.open();
    driver.tell({ type: "memberLeft", member: 1 });
    expect(driver.core.hasEnded).toBe(true);
    expect(driver.core.wantsClose).toBe(true);
  });

  it("ends on a bad packet, a second welcome, or a message that only clients send", () => {
    const spoil: ((driver: LinkCoreDriver) => void)[] = [
      (driver) => driver.core.onPacket(new Uint8Array(40), driver.nowNs),
      (driver) => driver.tell(driver.welcome()),
      (driver) => driver.core.onPacket(encodePacket(0, { type: "setLevel", character: 1, level: 0 }), driver.nowNs),
    ];
    for (const each of spoil) {
      const driver = new LinkCoreDriver();
      driver.join();
      each(driver);
      expect(driver.core.hasEnded).toBe(true);
      expect(driver.events().at(-1)).toMatchObject({ type: "disconnected", reason: GoodbyeReason.protocolError });
    }
  });

  it("refuses a room whose name cannot be, and calls with arguments that no server takes", () => {
    expect(() => new LinkCore({ room: "a/b" })).toThrow(HairnetError);
    const driver = new LinkCoreDriver();
    expect(() => driver.core.send(addCharacter(0, groom))).toThrow(HairnetError);
    expect(() => driver.core.send(addCharacter(1, "xyz"))).toThrow(HairnetError);
    expect(() => driver.core.pushPoses([{ ...pose(1, 1), pose: new Float64Array(35) }])).toThrow(HairnetError);
    expect(driver.join()).toEqual([]);
  });

  it("takes server times to its own by the least delay", () => {
    const driver = new LinkCoreDriver();
    driver.join();
    expect(driver.core.toLocalNs(driver.nowNs + driver.serverAheadNs)).toBe(driver.nowNs);
    driver.serverAheadNs -= 3e6; // this packet took 3 ms longer
    driver.tell(joined);
    expect(driver.core.toLocalNs(driver.nowNs + 5 * kSecond)).toBe(driver.nowNs);
  });
});

describe("link: grooms", () => {
  const file = Uint8Array.from({ length: 40_000 }, (_, i) => i % 251);

  it("sends a groom as it is asked for, poses before chunks", () => {
    const driver = new LinkCoreDriver();
    driver.join();
    const hash = driver.core.offerGroom(file);
    expect(driver.sent()).toMatchObject([{ type: "groomOffer", hash }]);
    driver.tell({ type: "groomNeed", hash, offset: 5_000 });
    driver.core.pushPoses([pose(1, 1)]);
    const said = driver.sent();
    expect(said[0].type).toBe("poseBatch");
    const chunks = said.slice(1) as m.GroomChunk[];
    const received = chunks.flatMap((chunk) => Array.from(chunk.bytes));
    expect(chunks[0].offset).toBe(5_000);
    expect(received).toEqual(Array.from(file.subarray(5_000)));
    driver.tell({ type: "groomStatus", hash, state: GroomState.ready });
    driver.tell({ type: "groomNeed", hash, offset: 0 });
    expect(driver.sent()).toEqual([]);
  });

  it("still brings a groom through where poses always wait", () => {
    const driver = new LinkCoreDriver();
    driver.join();
    const hash = driver.core.offerGroom(file);
    driver.tell({ type: "groomNeed", hash, offset: 0 });
    let chunks = 0;
    for (let n = 0; n < 2000; ++n) {
      for (let p = 0; p < 3; ++p) driver.core.pushPoses([pose(1, 3 * n + p)]);
      driver.core.takePacket(driver.nowNs);
      driver.core.takePacket(driver.nowNs);
      chunks = driver.core.counters.bytesSent > file.length ? 1 : 0;
    }
    expect(chunks).toBe(1);
  });

  it("fetches another's groom and checks it against its hash", () => {
    const hash = hashGroom(file);
    const driver = new LinkCoreDriver();
    driver.join();
    driver.core.requestGroom(hash);
    driver.core.requestGroom(hash);
    expect(driver.sent()).toMatchObject([{ type: "groomRequest", hash, offset: 0 }]);
    const data = (offset: number, end: number): m.GroomData => ({
      type: "groomData",
      hash,
      byteCount: file.length,
      offset,
      bytes: file.subarray(offset, end),
    });
    driver.events();
    driver.tell(data(0, 30_000));
    expect(driver.events()).toEqual([]);
    driver.tell(data(30_000, 40_000));
    expect(driver.events()).toMatchObject([{ type: "groomFetched", hash, bytes: file, fault: "" }]);
  });

  it("says what is wrong with a groom that is not the one asked for, or has gaps", () => {
    for (const [hash, offset] of [
      [groom, 0],
      [hashGroom(file), 7],
    ] as const) {
      const driver = new LinkCoreDriver();
      driver.join();
      driver.events();
      driver.core.requestGroom(hash);
      driver.tell({ type: "groomData", hash, byteCount: file.length, offset, bytes: file.subarray(offset) });
      const [event] = driver.events();
      expect(event).toMatchObject({ type: "groomFetched", bytes: null });
    }
  });

  it("asks again after a lost connection from where the pieces broke off", () => {
    const hash = hashGroom(file);
    const driver = new LinkCoreDriver();
    driver.join();
    driver.core.requestGroom(hash);
    driver.tell({ type: "groomData", hash, byteCount: file.length, offset: 0, bytes: file.subarray(0, 100) });
    driver.break();
    expect(driver.rejoin()).toMatchObject([{ type: "groomRequest", hash, offset: 100 }]);
  });
});

describe("link: frames", () => {
  function joinedDriver(): LinkCoreDriver {
    const driver = new LinkCoreDriver();
    driver.join();
    driver.tell(joined);
    giveBasis(driver);
    return driver;
  }

  it("decodes each without those before it", () => {
    for (let n = 0; n < sequence.contents.length; ++n) {
      const driver = joinedDriver();
      driver.tell(batch(n));
      const [frame] = framesOf(driver.events());
      expect(Array.from(frame.coefficients)).toEqual(sequence.coefficients[n]);
      expect(frame).toMatchObject({ member: 300, character: 0, level: LevelIndex.low, stepStride: 2 });
      expect(frame.stepS).toBeCloseTo(2 / 30, 9);
      expect(frame.basis!.basis.deviationM.length).toBe(frame.coefficients.length);
      expect(driver.core.counters).toMatchObject({ framesUndecodable: 0, framesUnknown: 0 });
    }
  });

  it("hands them to a sink in place of events", () => {
    const driver = joinedDriver();
    const seen: number[][] = [];
    driver.core.setFrameSink((frame, sampleTimeNs, tick) => {
      expect(sampleTimeNs).toBe(tick * 33e6);
      seen.push(Array.from(frame.coefficients));
    });
    for (let n = 0; n < 8; ++n) driver.tell(batch(n));
    expect(seen).toEqual(sequence.coefficients.slice(0, 8));
    expect(driver.events()).toEqual([]);
  });

  it("shows hair at rest until its basis is here, and asks for it once in a while", () => {
    const driver = new LinkCoreDriver();
    driver.join();
    driver.tell(joined);
    driver.tell(announced);
    driver.events();
    driver.tell(batch(0, { level: LevelIndex.rigid, content: rigidContent() }));
    expect(driver.sent()).toEqual([]); // at rest anyway
    driver.tell(batch(1));
    expect(driver.sent()).toMatchObject([{ type: "groomRequest", hash: announced.basis }]);
    driver.tell(batch(2));
    expect(driver.sent()).toEqual([]);
    const [, before] = framesOf(driver.events());
    expect(before).toMatchObject({ level: LevelIndex.low, basis: null });
    expect(before.coefficients.length).toBe(0);
    driver.tell(basisData);
    driver.tell(batch(3));
    expect(Array.from(framesOf(driver.events())[0].coefficients)).toEqual(sequence.coefficients[3]);
    expect(driver.core.counters.framesUndecodable).toBe(0);
  });

  it("asks for no basis of hair that is of no use yet, also of one that sleeps", () => {
    const driver = new LinkCoreDriver();
    let isOfUse = false;
    driver.core.downloadHairOf((hash) => hash === announced.groom && isOfUse);
    driver.join();
    driver.tell(joined);
    driver.tell(announced);
    driver.tell(batch(1, { asleep: true }));
    expect(driver.sent()).toEqual([]);
    isOfUse = true;
    driver.pass(1e9);
    expect(driver.sent()).toMatchObject([{ type: "groomRequest", hash: announced.basis }]);
  });

  it("shows a sleeping character, of which no other frame comes, once its basis is here", () => {
    const driver = new LinkCoreDriver();
    driver.join();
    driver.tell(joined);
    driver.tell(announced);
    driver.events();
    driver.tell(batch(1, { asleep: true }));
    expect(driver.sent()).toMatchObject([{ type: "groomRequest", hash: announced.basis }]);
    expect(framesOf(driver.events())).toMatchObject([{ basis: null, repeated: false }]);
    driver.tell(basisData);
    const [again, ...more] = driver.events();
    expect(more).toEqual([]);
    expect(again).toMatchObject({ type: "frameBatch", tick: batch(1).tick });
    const [frame] = framesOf([again]);
    expect(frame).toMatchObject({ asleep: true, repeated: true });
    expect(Array.from(frame.coefficients)).toEqual(sequence.coefficients[1]);
    driver.tell(basisData);
    expect(framesOf(driver.events())).toEqual([]);
  });

  it("says what is wrong with a basis, and does not ask for it again", () => {
    const driver = new LinkCoreDriver();
    driver.join();
    driver.tell(joined);
    const file = new Uint8Array(100);
    driver.tell({ ...announced, basis: hashGroom(file) });
    driver.tell(batch(0));
    driver.events();
    driver.tell({ ...basisData, hash: hashGroom(file), byteCount: file.length, bytes: file });
    expect(driver.events()).toMatchObject([{ type: "error", reason: ErrorReason.groomInvalid, groom }]);
    driver.sent();
    driver.pass(5 * kSecond);
    driver.tell(batch(1));
    expect(driver.sent().filter(({ type }) => type !== "poseBatch")).toEqual([]);
  });

  it("carries a jump over from a frame that cannot be decoded", () => {
    const driver = joinedDriver();
    driver.tell(batch(2, { discontinuous: true, content: new Uint8Array(3) }));
    expect(framesOf(driver.events())).toEqual([]);
    driver.tell(batch(3));
    driver.tell(batch(4));
    expect(framesOf(driver.events()).map((frame) => frame.discontinuous)).toEqual([true, false]);
    expect(driver.core.counters.framesUndecodable).toBe(1);
  });

  it("carries a jump over from a frame that a newer one has overtaken", () => {
    const driver = joinedDriver();
    driver.tell(batch(3));
    driver.tell(batch(2, { discontinuous: true }));
    driver.tell(batch(4));
    driver.tell(batch(5));
    expect(framesOf(driver.events()).map((frame) => frame.discontinuous)).toEqual([false, true, false]);
    expect(driver.core.counters.framesUnknown).toBe(1);
  });

  it("says which packets may be lost: poses that others follow", () => {
    const driver = joinedDriver();
    const { core } = driver;
    const taken: boolean[] = [];
    driver.sent();
    core.send(addCharacter(1, groom));
    core.pushPoses([pose(1, 1)]);
    core.pushPoses([pose(1, 2, true)]);
    while (core.takePacket(driver.nowNs)) taken.push(core.takenMayBeLost);
    expect(taken).toEqual([false, true, false]);
  });

  it("drops those in datagrams that are of an earlier or later member of the same number", () => {
    const driver = new LinkCoreDriver();
    driver.join();
    driver.tell(joined);
    giveBasis(driver);
    driver.tell(batch(1, {}, 101, 0));
    expect(framesOf(driver.events())).toHaveLength(1);
    driver.tell(batch(5, {}, 105, 1)); // of the next member, which is not announced yet
    driver.tell({ type: "memberLeft", member: 300 });
    driver.tell({ ...joined, generation: 1 });
    driver.tell(batch(4, {}, 104, 0)); // of the member before
    expect(framesOf(driver.events())).toEqual([]);
    expect(driver.core.counters.framesUnknown).toBe(2);
    driver.tell(batch(6, {}, 106, 1));
    driver.tell(batch(7)); // in the channel nothing is overtaken
    expect(framesOf(driver.events())).toHaveLength(2);
  });

  it("drops those in a datagram that overtakes the welcome", () => {
    const driver = new LinkCoreDriver();
    driver.open();
    driver.tell(batch(1, {}, 101, 0));
    expect(driver.core.hasEnded).toBe(false);
    expect(driver.core.counters.framesUnknown).toBe(1);
  });

  it("refuses spoilt contents without harm to those that follow", () => {
    const driver = joinedDriver();
    driver.tell(batch(0, { content: Uint8Array.of(...fromHex(sequence.contents[0]), 1) }));
    driver.tell(batch(0, {}, 101));
    expect(framesOf(driver.events()).length).toBe(1);
    expect(driver.core.isActive).toBe(true);
  });

  it("ignores frames of unknown members, and late frames", () => {
    const driver = joinedDriver();
    driver.tell(batch(0, { member: 301 }));
    driver.tell(batch(0, {}, 105));
    driver.tell(batch(0, {}, 104));
    expect(framesOf(driver.events()).length).toBe(1);
    expect(driver.core.counters.framesUnknown).toBe(2);
  });

  it("drops the oldest frames of a caller that never polls, and keeps their jumps", () => {
    const driver = joinedDriver();
    driver.tell(batch(0, { discontinuous: true }, 1));
    const frameBytes = 4 * sequence.coefficients[0].length + 1024;
    const count = Math.ceil((33 << 20) / frameBytes);
    for (let tick = 2; tick < count; ++tick) driver.tell(batch(0, {}, tick));
    const frames = framesOf(driver.events());
    expect(driver.core.counters.framesDropped).toBeGreaterThan(0);
    expect(frames.length + driver.core.counters.framesDropped).toBe(count - 1);
    expect(frames.map((frame) => frame.discontinuous).indexOf(true)).toBe(0);
  });
});

describe("link: spoilt packets", () => {
  it("end the connection or do nothing, and never throw, at 20 000 mutations", () => {
    const random = seeded(9);
    const below = (count: number) => Math.floor(random() * count);
    const welcome = serverPacket(1, new LinkCoreDriver().welcome());
    const sound = [joined, announced, batch(0), basisData, batch(1), batch(2)].map((message) =>
      serverPacket(1, message),
    );
    const others = vectors<{ packet: string }[]>("packets.json").map((each) => fromHex(each.packet));
    const packets = [welcome, ...sound, ...sound, ...others];
    let ended = 0;
    let driver = new LinkCoreDriver();
    driver.join();
    for (let n = 0; n < 20_000; ++n) {
      const packet = packets[below(packets.length)].slice();
      for (let changes = below(3); changes > 0; --changes) packet[below(packet.length)] ^= 1 << below(8);
      driver.core.onPacket(packet, driver.nowNs);
      driver.pass(1e6);
      driver.sent();
      driver.events();
      if (driver.core.isActive) continue;
      ++ended;
      driver = new LinkCoreDriver();
      driver.join();
      for (const each of sound) driver.core.onPacket(each, driver.nowNs);
    }
    expect(ended).toBeGreaterThan(1_000);
  });
});

describe("link: staying alive, importance, poses", () => {
  it("gives a sign of life in every quarter of the time for them", () => {
    const driver = new LinkCoreDriver();
    driver.join();
    driver.pass(2 * kSecond);
    expect(driver.sent()).toEqual([]);
    expect(driver.core.nextDeadlineNs - driver.nowNs).toBe(0.5 * kSecond);
    driver.pass(0.5 * kSecond);
    expect(driver.sent()).toEqual([{ type: "poseBatch", poses: [] }]);
  });

  it("reports importance a few times a second at most, and what has changed", () => {
    const driver = new LinkCoreDriver();
    driver.join();
    driver.core.reportImportance([{ member: 1, screenHeight: 0.5, inView: true }]);
    driver.pass(0);
    expect(driver.sent().length).toBe(1);
    driver.core.reportImportance([{ member: 1, screenHeight: 0.52, inView: true }]);
    driver.pass(1 * kSecond);
    expect(driver.sent()).toEqual([]);
    driver.core.reportImportance([{ member: 1, screenHeight: 0.7, inView: true }]);
    driver.pass(0.01 * kSecond);
    expect(driver.sent()).toMatchObject([{ type: "reportImportance" }]);
    driver.core.reportImportance([{ member: 1, screenHeight: 0.1, inView: true }]);
    driver.pass(0.01 * kSecond);
    expect(driver.sent()).toEqual([]);
    driver.pass(0.25 * kSecond);
    expect(driver.sent().length).toBe(1);
  });

  it("undoes what was reported of a member when it leaves", () => {
    const driver = new LinkCoreDriver();
    driver.join();
    driver.core.reportImportance([{ member: 1, screenHeight: 0.5, inView: false }]);
    driver.pass(0);
    driver.sent();
    driver.tell({ type: "memberLeft", member: 1 });
    driver.pass(0.25 * kSecond);
    expect(driver.sent()).toMatchObject([{ type: "reportImportance", members: [{ member: 1, inView: true }] }]);
    driver.tell({ type: "memberLeft", member: 1 });
    driver.tell({ type: "memberLeft", member: 2 });
    driver.pass(0.25 * kSecond);
    expect(driver.sent()).toEqual([]);
  });

  it("drops the oldest poses when the connection does not keep up, and passes their teleports on", () => {
    const driver = new LinkCoreDriver();
    driver.join();
    driver.core.pushPoses([pose(1, 1, true)]);
    for (let n = 2; n < 100; ++n) driver.core.pushPoses([pose(1, n)]);
    const said = driver.sent() as m.PoseBatch[];
    expect(said.length).toBe(64);
    expect(said[0].poses[0]).toMatchObject({ sequence: 36, teleport: true });
    expect(said.slice(1).some((each) => each.poses[0].teleport)).toBe(false);
    expect(driver.core.counters.posesDropped).toBe(35);
  });

  it("drops poses while there is no connection, and passes their teleports on", () => {
    const driver = new LinkCoreDriver();
    driver.core.pushPoses([pose(1, 1, true), pose(2, 1)]);
    driver.join();
    driver.core.pushPoses([pose(1, 2), pose(2, 2)]);
    const [said] = driver.sent() as m.PoseBatch[];
    expect(said.poses.map((each) => each.teleport)).toEqual([true, false]);
  });
});
