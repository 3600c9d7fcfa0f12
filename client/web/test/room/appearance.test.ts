import { describe, expect, it } from "vitest";
import { HairnetError } from "../../src/hair/hairnetError";
import { defaultAppearance, type Appearance } from "../../src/hair/appearance";
import { notFinite } from "../../src/hair/droppedInput";
import { LevelIndex } from "../../src/hair/level";
import type { ClientMessage } from "../../src/net/messages";
import type { Member } from "../../src/room/index";
import { kPlain } from "../support/linkCoreDriver";
import { ServedRoom } from "../support/servedRoom";

const groom = "ab".repeat(32);
const kRed: Appearance = { hairRoot: 0x9e5930, hairTip: 0xb07040, skin: 0xe0c0b0, roughness: 77 / 255 };
const bytes = (text: string) => new TextEncoder().encode(text);

/** A room with a member of another client, of whose kind own characters are added. */
function withMember(): { served: ServedRoom; other: Member } {
  const served = new ServedRoom();
  const joined = { type: "memberJoined", member: 5, session: 9n, character: 2, groom } as const;
  served.receive({ ...joined, tag: bytes("Ann"), appearance: kRed });
  served.room.sample(0);
  return { served, other: served.room.members.get(5)! };
}

async function said<T extends ClientMessage["type"]>(served: ServedRoom, type: T) {
  await Promise.resolve();
  served.link.flush();
  return served.sent().filter((each): each is Extract<ClientMessage, { type: T }> => each.type === type);
}

const many = (count: number) => new Uint8Array(count);
const colours: unknown[] = [
  -1,
  0x1000000,
  1.5,
  Number.NaN,
  Infinity,
  -Infinity,
  "#ff0000",
  "red",
  null,
  {},
  [255],
  true,
  1n,
];
const kBadTags: unknown[] = [
  many(257),
  many(1000),
  many(65_536),
  "x".repeat(257),
  "\u00e9".repeat(129),
  "\u{1f487}".repeat(65),
  "\ud800",
  "a\udc00b",
  7,
  true,
  {},
  [65, 66],
  new Uint16Array(2),
  new ArrayBuffer(4),
  null,
  () => "Ann",
]; // prettier-ignore
const kBadAppearances: unknown[] = [
  ...["hairRoot", "hairTip", "skin"].flatMap((name) => colours.map((colour) => ({ [name]: colour }))),
  { roughness: -0.01 },
  { roughness: 1.01 },
  { roughness: Number.NaN },
  { roughness: "0.5" },
  { roughness: {} },
  { hair: 0xff0000 },
  { colour: 0xff0000, hairRoot: 0 },
  "red",
  0xff0000,
  [0xff0000],
  true,
]; // prettier-ignore

describe("tags and appearances that are not valid", () => {
  it("are of 64 kinds and more", () => {
    expect(kBadTags.length + kBadAppearances.length).toBeGreaterThanOrEqual(64);
  });

  it("are refused in one plain line, and change nothing", async () => {
    const { served, other } = withMember();
    const own = served.room.addCharacterLike(other, { tag: "Ben", appearance: { skin: 0x102030 } });
    expect(await said(served, "addCharacter")).toHaveLength(1);
    const { tag, appearance } = own;
    const refused = (call: () => unknown) => {
      let thrown: unknown = null;
      try {
        call();
      } catch (error) {
        thrown = error;
      }
      expect(thrown).toBeInstanceOf(HairnetError);
      expect((thrown as HairnetError).message).toMatch(/^(tag|appearance): [^\n]{5,120}$/);
    };
    for (const bad of kBadTags) {
      refused(() => own.setAppearance({}, bad as string));
      refused(() => served.room.addCharacterLike(other, { tag: bad as string }));
    }
    for (const bad of kBadAppearances) {
      if (notFinite(bad ?? {})) own.setAppearance(bad as Partial<Appearance>);
      else refused(() => own.setAppearance(bad as Partial<Appearance>));
      refused(() => served.room.addCharacterLike(other, { appearance: bad as Partial<Appearance> }));
    }
    expect(() => served.room.addCharacterLike(other, LevelIndex.low as never)).toThrow(HairnetError);
    refused(() => own.setAppearance(null as unknown as Appearance));
    expect(own.tag).toEqual(tag);
    expect(own.appearance).toEqual(appearance);
    await Promise.resolve();
    expect(served.sent()).toEqual([]);
    const next = served.room.addCharacterLike(other);
    expect(next.character).toBe(own.character + 1);
  });
});

describe("an own character", () => {
  it("is sent with its tag and its whole appearance, or none", async () => {
    const { served, other } = withMember();
    served.room.addCharacterLike(other, { level: LevelIndex.low, tag: "B\u00e9n", appearance: { hairRoot: 0xff0000 } });
    served.room.addCharacterLike(other, { tag: new Uint8Array([0, 255]) });
    const added = await said(served, "addCharacter");
    expect(added[0].level).toBe(LevelIndex.low);
    expect(added[0].tag).toEqual(bytes("B\u00e9n"));
    const { skin, roughness } = defaultAppearance(1);
    expect(added[0].appearance).toEqual({ hairRoot: 0xff0000, hairTip: 0xff0000, skin, roughness });
    expect(added[1].tag).toEqual(new Uint8Array([0, 255]));
    expect(added[1].appearance).toBeNull();
  });

  it("knows its member, which has the room's session and is found by both its numbers", () => {
    const { served, other } = withMember();
    const own = served.room.addCharacterLike(other, { tag: "Ben", appearance: kRed });
    expect(own.member).toBeNull();
    served.receive({ type: "characterAdded", character: own.character, groom, level: LevelIndex.low, member: 8 });
    served.room.sample(0);
    expect(own.member?.member).toBe(8);
    expect(own.member).toBe(served.room.members.get(8));
    expect(served.room.session).toBe(77n);
    expect(served.room.memberOf(77n, own.character)).toBe(own.member);
    expect(own.member).toMatchObject({ session: 77n, ownerCharacter: own.character, tagText: "Ben", appearance: kRed });
    served.room.removeCharacter(own);
    expect(own.member).toBeNull();
  });

  it("changes for this client at once, keeps what is not named, and tells the server", async () => {
    const { served, other } = withMember();
    const own = served.room.addCharacterLike(other, { tag: "Ben", appearance: kRed });
    served.receive({ type: "characterAdded", character: own.character, groom, level: LevelIndex.low, member: 8 });
    served.room.sample(0);
    await said(served, "addCharacter");
    const changed: Member[] = [];
    served.room.on("changed", ({ member }) => changed.push(member));
    own.setAppearance({ skin: 0x010203 });
    own.setAppearance({ hairRoot: 0x00ff00 }, "Benjamin");
    expect(changed).toEqual([own.member, own.member]);
    const newest = { hairRoot: 0x00ff00, hairTip: 0x00ff00, skin: 0x010203, roughness: kRed.roughness };
    expect(own.member).toMatchObject({ tagText: "Benjamin", appearance: newest });
    const sets = await said(served, "setAppearance");
    expect(sets.map(({ tag }) => new TextDecoder().decode(tag))).toEqual(["Ben", "Benjamin"]);
    expect(sets[1].appearance).toEqual(newest);
  });

  it("is told to a server that has lost the session with its newest tag and appearance", async () => {
    const { served, other } = withMember();
    const own = served.room.addCharacterLike(other, { tag: "Ben" });
    own.setAppearance({ skin: 0x010203 }, "Benjamin");
    served.reconnect({ session: 78n });
    const added = await said(served, "addCharacter");
    expect(added[0]).toMatchObject({ tag: bytes("Benjamin"), appearance: { skin: 0x010203 } });
    served.room.sample(0);
    expect(served.room.session).toBe(78n);
  });
});

describe("a member of another client", () => {
  it("has its owner's tag, appearance, session and number", () => {
    const { served, other } = withMember();
    expect(other).toMatchObject({ session: 9n, ownerCharacter: 2, tagText: "Ann", appearance: kRed, character: 0 });
    expect(served.room.memberOf(9n, 2)).toBe(other);
    expect(served.room.memberOf(9n, 3)).toBeNull();
    expect(served.room.memberOf(8n, 2)).toBeNull();
  });

  it("changes with its owner, also while the connection was away", () => {
    const { served, other } = withMember();
    const changed: string[] = [];
    served.room.on("changed", ({ member }) => changed.push(member.tagText));
    served.receive({ type: "memberChanged", member: 5, tag: bytes("Anna"), appearance: null });
    served.receive({ type: "memberChanged", member: 5, tag: bytes("Anna"), appearance: null });
    served.receive({ type: "memberChanged", member: 6, tag: bytes("Eve"), appearance: null });
    served.room.sample(0);
    expect(changed).toEqual(["Anna"]);
    expect(other.appearance).toEqual(defaultAppearance(5));
    served.reconnect({ resumed: true });
    const joined = { type: "memberJoined", member: 5, session: 9n, character: 2, groom } as const;
    served.receive({ ...joined, tag: bytes("Hanna"), appearance: kRed });
    served.room.sample(0);
    expect(changed).toEqual(["Anna", "Hanna"]);
    expect(served.room.members.get(5)).toBe(other);
    expect(other.appearance).toEqual(kRed);
  });

  it("has no text where its tag is none", () => {
    const { served, other } = withMember();
    for (const tag of [new Uint8Array([0xff, 0xfe]), bytes("a\nb"), new Uint8Array()]) {
      served.receive({ type: "memberChanged", member: 5, tag, appearance: null });
      served.room.sample(0);
      expect(other.tagText).toBe("");
      expect(other.tag).toEqual(tag);
    }
  });

  it("has the same default appearance everywhere, neighbours different ones", () => {
    const { served } = withMember();
    served.receive({ type: "memberJoined", member: 6, session: 9n, character: 3, groom, ...kPlain });
    served.room.sample(0);
    expect(served.room.members.get(6)!.appearance).toEqual(defaultAppearance(6));
    expect(defaultAppearance(6).hairRoot).not.toBe(defaultAppearance(7).hairRoot);
  });
});

describe("the wind of a room", () => {
  it("is what the server says, and still before", () => {
    const served = new ServedRoom();
    expect(served.room.wind.meanMPerS).toEqual([0, 0, 0]);
    expect(served.room.maySetWind).toBe(true);
    const told: bigint[] = [];
    served.room.on("wind", ({ session }) => told.push(session));
    const wind = { ...served.room.wind, meanMPerS: [1, 2, 3] as const };
    served.receive({ type: "roomWind", wind, session: 9n });
    served.room.sample(0);
    expect(served.room.wind).toEqual(wind);
    expect(told).toEqual([9n]);
  });
});
