import { expect, test } from "vitest";
import { LevelIndex } from "../../src/hair/level";
import { rigidPose } from "../../src/hair/pose";
import { GoodbyeReason, ModerateAction } from "../../src/net/messages";
import { LinkCoreDriver, kPlain } from "../support/linkCoreDriver";
import { ServedRoom } from "../support/servedRoom";

const kSecond = 1e9;
const groom = "ab".repeat(32);

test("shows a sleeping member whose only frame came together with the news of it", () => {
  const served = new ServedRoom();
  served.receive({ type: "memberJoined", member: 5, session: 9n, character: 1, groom, ...kPlain });
  served.receiveAsleep(5);
  const [member] = served.room.sample(0);
  expect(member.member).toBe(5);
  served.nowNs += kSecond;
  served.room.sample(0);
  expect(member.pose && [...member.pose]).toEqual([...rigidPose()].map((x) => expect.closeTo(x, 4)));
});

/** Requests for grooms that it sends in so many seconds, with a picture every 0.1 s. */
function requestsAfter(served: ServedRoom, seconds: number): number {
  for (let s = 0; s < seconds; s += 0.1) {
    served.nowNs += 0.1 * kSecond;
    served.room.sample(0);
  }
  served.link.flush();
  return served.sent().filter((message) => message.type === "groomRequest").length;
}

test("asks for a missing groom, and again later when no member can give it", () => {
  const served = new ServedRoom();
  served.receive({ type: "memberJoined", member: 5, session: 9n, character: 1, groom, ...kPlain });
  const requests = () => requestsAfter(served, 0.8);
  expect(requests()).toBe(1);
  served.receive({ type: "error", reason: 20, character: 0, groom, detail: "not here" }); // groomUnavailable
  expect(requests()).toBe(0);
  expect(requestsAfter(served, 4)).toBe(1);
});

test("forgets members that have left, and reports members in order", () => {
  const served = new ServedRoom();
  const heard: string[] = [];
  served.room.on("joined", ({ member }) => heard.push(`joined ${member.member}`));
  const stop = served.room.on("left", ({ member }) => heard.push(`left ${member.member}`));
  served.receive({ type: "memberJoined", member: 5, session: 9n, character: 1, groom, ...kPlain });
  served.receive({ type: "memberJoined", member: 6, session: 9n, character: 2, groom, ...kPlain });
  served.receive({ type: "memberLeft", member: 5 });
  expect(served.room.sample(0).map((member) => member.member)).toEqual([6]);
  expect(heard).toEqual(["joined 5", "joined 6", "left 5"]);
  stop();
  served.receive({ type: "memberLeft", member: 6 });
  expect(served.room.sample(0)).toEqual([]);
  expect(heard).toHaveLength(3);
});

test("an own character is drawn with the last pushed pose, independent of frames", () => {
  const served = new ServedRoom();
  served.receive({ type: "memberJoined", member: 5, session: 9n, character: 1, groom, ...kPlain });
  served.room.sample(0);
  const own = served.room.addCharacterLike(served.room.members.get(5)!);
  served.receive({ type: "characterAdded", character: own.character, groom, level: LevelIndex.rigid, member: 7 });
  served.receiveAsleep(7);
  own.push(rigidPose([0, 0, 0, 1], [1, 2, 3]));
  served.room.sample(0);
  const mine = served.room.members.get(7)!;
  expect(mine.own).toBe(true);
  expect([...mine.pose!.subarray(4, 7)]).toEqual([1, 2, 3]);
  own.push(rigidPose([0, 0, 0, 1], [NaN, 2, 3]));
  expect([...served.room.members.get(7)!.pose!.subarray(4, 7)]).toEqual([1, 2, 3]);
});

test("all own characters exist when a new server swaps their numbers, and their hair continues", () => {
  const served = new ServedRoom();
  served.receive({ type: "memberJoined", member: 5, session: 9n, character: 1, groom, ...kPlain });
  served.room.sample(0);
  const like = served.room.members.get(5)!;
  const own = [served.room.addCharacterLike(like), served.room.addCharacterLike(like)];
  const add = (n: number, member: number) =>
    served.receive({ type: "characterAdded", character: own[n].character, groom, level: LevelIndex.rigid, member });
  add(0, 1);
  add(1, 2);
  served.room.sample(0);
  const playouts = own.map(
    ({ character }) => [...served.room.members.values()].find((one) => one.character === character)!.playout,
  );
  served.socket.onclose?.({ code: 1006, reason: "" });
  served.nowNs += 20 * kSecond;
  served.room.sample(0);
  served.socket.open();
  served.receive(new LinkCoreDriver().welcome());
  add(0, 2);
  add(1, 1);
  served.receiveAsleep(2); // before any sample has processed the new numbers
  served.room.sample(0);
  expect([...served.room.members.keys()].sort()).toEqual([1, 2]);
  own.forEach(({ character }, n) => {
    const member = served.room.members.get(2 - n)!;
    expect(member.character).toBe(character);
    expect(member.playout).toBe(playouts[n]);
  });
  expect(served.room.delayS(served.room.members.get(2)!)).toBeGreaterThan(0);
  expect(served.room.delayS(served.room.members.get(1)!)).toBe(0);
});

test("an unused groom is not requested again, and not kept as damaged", () => {
  const served = new ServedRoom();
  const requests = () => requestsAfter(served, 0.8);
  const join = (member: number) =>
    served.receive({ type: "memberJoined", member, session: 9n, character: 1, groom, ...kPlain });
  const leave = (member: number) => served.receive({ type: "memberLeft", member });
  join(5);
  expect(requests()).toBe(1);
  leave(5);
  served.receive({ type: "error", reason: 20, character: 0, groom, detail: "not here" }); // groomUnavailable
  expect(requests()).toBe(0);
  expect(requestsAfter(served, 4)).toBe(0);
  // A groom that was damaged on its way may arrive intact the next time.
  join(6);
  expect(requests()).toBe(1);
  served.receive({ type: "groomData", hash: groom, offset: 0, byteCount: 3, bytes: new Uint8Array(3) });
  served.room.sample(0);
  expect(served.room.members.get(6)!.fault).not.toBe("");
  leave(6);
  join(7);
  expect(requests()).toBe(1);
  expect(served.room.members.get(7)!.fault).toBe("");
});

test("reports a lost and a restored connection", () => {
  const served = new ServedRoom();
  const states: string[] = [];
  served.room.on("state", ({ state }) => states.push(state));
  served.room.sample(0);
  served.socket.onclose?.({ code: 1006, reason: "" });
  served.room.sample(0);
  expect(served.room.state).toBe("reconnecting");
  served.nowNs += 20 * kSecond;
  served.room.sample(0);
  served.socket.open();
  served.receive(new LinkCoreDriver().welcome({ resumed: true }));
  served.room.sample(0);
  expect(states.filter((state, n) => state !== states[n - 1])).toEqual(["connected", "reconnecting", "connected"]);
  served.room.close();
  expect(served.room.state).toBe("closed");
});

test("moderates the owner of a member, a named person, or the room", () => {
  const served = new ServedRoom();
  served.receive({ type: "memberJoined", member: 5, session: 9n, character: 1, groom, ...kPlain });
  served.room.sample(0);
  served.link.flush();
  served.sent();
  const { room } = served;
  room.moderate(ModerateAction.remove, room.members.get(5)!, 60, "be kind");
  room.moderate(ModerateAction.mute, "sub:mallory");
  room.moderate(ModerateAction.lock);
  served.link.flush();
  const nobody = { type: "moderate", session: 0n, subject: "", seconds: 0, reason: "" };
  expect(served.sent()).toEqual([
    { ...nobody, action: ModerateAction.remove, session: 9n, seconds: 60, reason: "be kind" },
    { ...nobody, action: ModerateAction.mute, subject: "sub:mallory" },
    { ...nobody, action: ModerateAction.lock },
  ]);
  expect(() => room.moderate(ModerateAction.remove, "sub:mallory", -1)).toThrow("seconds of a ban");
});

test("a removal by a moderator closes the room as refused", () => {
  const served = new ServedRoom();
  const closed: { detail: string; isRefused: boolean }[] = [];
  served.room.on("state", ({ state, detail, isRefused }) => {
    if (state === "closed") closed.push({ detail, isRefused });
  });
  served.receive({ type: "goodbye", reason: GoodbyeReason.removed, detail: "be kind" });
  served.room.sample(0);
  expect(closed).toEqual([{ detail: "the server says goodbye: be kind", isRefused: true }]);
  expect(served.sockets.length).toBe(1);
});

test("a refusal that would come again closes the room as refused", () => {
  const served = new ServedRoom();
  const closed: boolean[] = [];
  served.room.on("state", ({ state, isRefused }) => state === "closed" && closed.push(isRefused));
  served.receive({ type: "goodbye", reason: GoodbyeReason.tokenRefused, detail: "expired" });
  served.room.sample(0);
  expect(closed).toEqual([true]);
});

test("fetches a member's groom first, also when it is named before it joins", () => {
  const served = new ServedRoom();
  const grooms = ["1", "2"].map((digit) => digit.repeat(64));
  served.room.fetchFirst(2);
  for (const [i, hash] of grooms.entries())
    served.receive({ type: "memberJoined", member: 1 + i, session: 9n, character: 1 + i, groom: hash, ...kPlain });
  served.room.sample(0);
  served.link.flush();
  const asked = served.sent().flatMap((message) => (message.type === "groomRequest" ? [message.hash] : []));
  expect(asked).toEqual([grooms[1]]);
});

test("asks for no other groom while it fetches only the first", () => {
  const served = new ServedRoom();
  const hash = "1".repeat(64);
  const asked = () => {
    for (let n = 0; n < 2; ++n) served.room.reportImportance([{ member: 1, screenHeight: 0.9, inView: true }]);
    served.room.sample(0);
    served.link.flush();
    return served.sent().flatMap((message) => (message.type === "groomRequest" ? [message.hash] : []));
  };
  served.room.fetchesOnlyFirst = true;
  served.receive({ type: "memberJoined", member: 1, session: 9n, character: 1, groom: hash, ...kPlain });
  expect(asked()).toEqual([]);
  served.room.fetchesOnlyFirst = false;
  expect(asked()).toEqual([hash]);
});

test("fetches one groom after the other, that of the largest head first", () => {
  const served = new ServedRoom();
  const grooms = ["1", "2", "3"].map((digit) => digit.repeat(64));
  const asked = () => {
    served.room.sample(0);
    served.link.flush();
    return served.sent().flatMap((message) => (message.type === "groomRequest" ? [message.hash] : []));
  };
  for (const [i, hash] of grooms.entries())
    served.receive({
      type: "memberJoined",
      member: 1 + i,
      session: 9n,
      character: 1 + i,
      groom: hash,
      tag: new Uint8Array(0),
      appearance: null,
    });
  expect(asked()).toEqual([]);
  const importance = [
    { member: 2, screenHeight: 0.9, inView: false },
    { member: 3, screenHeight: 0.1, inView: true },
  ];
  for (let n = 0; n < 2; ++n) served.room.reportImportance(importance);
  expect(asked()).toEqual([grooms[2]]);
  expect(asked()).toEqual([]);
  served.receive({ type: "error", reason: 20, character: 0, groom: grooms[2], detail: "not here" }); // groomUnavailable
  expect(asked()).toEqual([grooms[1]]);
  served.receive({ type: "groomData", hash: grooms[1], offset: 0, byteCount: 3, bytes: new Uint8Array(3) });
  expect(asked()).toEqual([grooms[0]]);
});
