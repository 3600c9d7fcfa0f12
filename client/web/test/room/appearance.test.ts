import { afterAll, afterEach, beforeAll, describe, expect, it } from "vitest";
import { changedAppearance, defaultAppearance, type Appearance } from "../../src/hair/appearance";
import { notFinite } from "../../src/hair/droppedInput";
import { HairnetError } from "../../src/module/hairnetError";
import { LevelIndex } from "../../src/hair/level";
import { strandsFile } from "../support/grooms";
import { Person } from "../support/person";
import { Server } from "../support/server";
import { until } from "../support/until";
import { waitingRoom } from "../support/waitingRoom";

// The roughness travels as a byte, so it is a multiple of 1 / 255.
const kRed: Appearance = { hairRoot: 0x9e5930, hairTip: 0xb07040, skin: 0xe0c0b0, roughness: 77 / 255 };

const many = (count: number) => new Uint8Array(count);
// A colour is a whole number from 0 to 0xffffff. Other libraries take some of these.
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
// A tag has at most 256 bytes (kTagBytesMax). Text is counted in UTF-8, and has no lone surrogates; the letters here
// have 1, 2 and 4 bytes.
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
];
// The roughness is 0 to 1. The last ones have names that an appearance lacks, or are no objects of numbers.
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
];

describe("tags and appearances that are not valid", () => {
  it("are of 64 kinds and more", () => {
    expect(kBadTags.length + kBadAppearances.length).toBeGreaterThanOrEqual(64);
  });

  it("are refused in one plain line, and change nothing", async () => {
    const room = await waitingRoom();
    const file = await strandsFile(20, 6);
    const own = room.addCharacter(file, { tag: "Ben", appearance: { skin: 0x102030 } });
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
      refused(() => room.addCharacter(file, { tag: bad as string }));
    }
    for (const bad of kBadAppearances) {
      // A number that is not finite may come from a computation in a render loop: `setAppearance` drops and counts it.
      // `addCharacter` is called once, and refuses it.
      if (notFinite(bad ?? {})) own.setAppearance(bad as Partial<Appearance>);
      else refused(() => own.setAppearance(bad as Partial<Appearance>));
      refused(() => room.addCharacter(file, { appearance: bad as Partial<Appearance> }));
    }
    expect(() => room.addCharacter(file, LevelIndex.low as never)).toThrow(HairnetError);
    expect(() => room.addCharacter(file, { level: 9 as LevelIndex })).toThrow("there is no level 9");
    refused(() => own.setAppearance(null as unknown as Appearance));
    expect(own.tag).toEqual(tag);
    expect(own.appearance).toEqual(appearance);
    // The refused characters have not taken numbers.
    expect(room.addCharacter(file).character).toBe(own.character + 1);
    room.close();
  });
});

describe("an appearance", () => {
  it("keeps what a change does not name; a root alone colours the whole hair", () => {
    const changed = changedAppearance(kRed, { hairRoot: 0x00ff00, skin: undefined });
    expect(changed).toEqual({ ...kRed, hairRoot: 0x00ff00, hairTip: 0x00ff00 });
  });

  it("is by default another one for neighbours", () => {
    expect(defaultAppearance(6).hairRoot).not.toBe(defaultAppearance(7).hairRoot);
  });
});

describe("with a server", () => {
  const server = new Server();
  const people: Person[] = [];
  const join = async () => {
    const person = await Person.join(server.address);
    people.push(person);
    return person;
  };
  beforeAll(() => server.start());
  afterEach(() => {
    for (const person of people.splice(0)) person.leave();
  });
  afterAll(() => server.dispose());

  it("tags and appearances are everyone's, with what their owners change", async () => {
    const file = await strandsFile(20, 6);
    const ann = await join();
    ann.own = ann.room.addCharacter(file, { tag: "Ann", appearance: kRed });
    const ben = await join();
    const seen = await ben.meets("Ann");
    expect(seen.appearance).toEqual(kRed);
    // These bytes are no UTF-8.
    ben.own = ben.room.addCharacter(file, { tag: new Uint8Array([0, 255, 7]) });
    const bens = () => ann.room.memberOf(ben.room.session, ben.own!.character);
    await until("she meets him", () => bens() !== null);
    expect(bens()).toMatchObject({ tag: new Uint8Array([0, 255, 7]), tagText: "" });
    expect(bens()!.appearance).toEqual(defaultAppearance(bens()!.member));
    await until("both know their own", () => ann.own!.member !== null && ben.own!.member !== null);

    // Changes are there at once for herself. Others hear of them at most four times a second, so both changes may come
    // as one.
    ann.own.setAppearance({ skin: 0x010203 });
    ann.own.setAppearance({ hairRoot: 0x00ff00 }, "Anna");
    const newest = { hairRoot: 0x00ff00, hairTip: 0x00ff00, skin: 0x010203, roughness: kRed.roughness };
    expect(ann.own.member).toMatchObject({ tagText: "Anna", appearance: newest });
    await until("he is told", () => ben.heard.includes("changed Anna"));
    expect(seen).toMatchObject({ tagText: "Anna", appearance: newest });
    // A tag is any bytes, but a text with a line break is no name: `tagText` is empty.
    ann.own.setAppearance({}, "a\nb");
    await until("he is told again", () => ben.heard.includes("changed "));
    expect(seen).toMatchObject({ tagText: "", tag: new TextEncoder().encode("a\nb") });
    expect([...ann.heard, ...ben.heard].filter((line) => line.startsWith("error"))).toEqual([]);
  });
});
