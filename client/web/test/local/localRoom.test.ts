import { beforeAll, expect, test, vi } from "vitest";
import { HairnetError, LevelIndex, materials, rigidPose, type Member, type OwnCharacter } from "../../src/index";
import { buildLevels, LocalRoom, type LocalCharacterOptions } from "../../src/local/index";
import { localModule, strandsFile } from "../support/grooms";
import { errorOf } from "../support/errorOf";
import { until } from "../support/until";

/** One picture for each tick of the hair: 60 Hz is the default rate of a LocalRoom. */
const kStepMs = 1000 / 60;

// In these tests a head that turns goes 0.5 rad to both sides, 1.3 times a second. Its hair is then some millimetres
// from rest; within 1 mm it counts as at rest.
let groom: Uint8Array<ArrayBuffer>;
let levels: Uint8Array<ArrayBuffer>;
const reported: number[] = [];

beforeAll(async () => {
  groom = await strandsFile();
  levels = await buildLevels(groom, (share) => reported.push(share));
}, 120_000);

/** A room with one head at the origin, and its clock. */
async function roomWithHead(options: LocalCharacterOptions = {}) {
  const room = await LocalRoom.open();
  const own = room.addCharacter(groom, { levels, ...options });
  own.push(rigidPose());
  // A page begins at any time of its clock, so the room must not count from 0.
  let nowMs = 5000;
  /**
   * Draws pictures for so many seconds. `turn` gives the angle of all heads about +Y, in rad, at a time since the
   * start.
   */
  const run = (seconds: number, turn: (timeS: number) => number = () => 0) => {
    const endMs = nowMs + 1000 * seconds;
    for (; nowMs < endMs; nowMs += kStepMs) {
      const half = turn((nowMs - 5000) / 1000) / 2;
      for (const one of room.members.values()) ownOf(one)?.push(rigidPose([0, Math.sin(half), 0, Math.cos(half)]));
      room.sample(nowMs);
    }
  };
  const all = new Map<number, OwnCharacter>([[own.character, own]]);
  const ownOf = (member: Member) => all.get(member.character);
  run(0.1);
  return { room, own, run, member: own.member!, add: (one: OwnCharacter) => all.set(one.character, one) };
}

/** How far the hair is from how it lies at rest, m; the head stands where it began. */
function awayFromRest(member: Member): number {
  const rest = member.groom!.points;
  return member.points()!.reduce((most, x, i) => Math.max(most, Math.abs(x - rest[i])), 0);
}

test("hair at rest stays, swings with the head, and comes to rest", async () => {
  const { member, run } = await roomWithHead();
  expect(awayFromRest(member)).toBeLessThan(0.001);
  run(1, (t) => 0.5 * Math.sin(8 * t));
  // The head is back at its first pose for one picture, while the hair still swings.
  run(0.02);
  expect(member.level).toBe(LevelIndex.high);
  expect(member.lattice).not.toBeNull();
  expect(awayFromRest(member)).toBeGreaterThan(0.005);
  // 12 s are ample time for the swing to die down.
  run(12);
  expect(awayFromRest(member)).toBeLessThan(0.001);
});

test("a jump that is told swings no hair, and one that is not does", async () => {
  const { own, member, room } = await roomWithHead();
  let nowMs = 10_000;
  const swing = (x: number, teleport: boolean) => {
    own.push(rigidPose([0, 0, 0, 1], [x, 0, 0]), teleport);
    let most = 0;
    for (let i = 0; i < 24; ++i, nowMs += kStepMs) {
      room.sample(nowMs);
      // The hair is shown one tick behind the head, so in the first pictures after the jump it is not there yet.
      if (i < 4) continue;
      const rest = member.groom!.points;
      member.points()!.forEach((value, k) => {
        most = Math.max(most, Math.abs(value - rest[k] - (k % 3 === 0 ? x : 0)));
      });
    }
    return most;
  };
  // The head jumps by 5 cm, and back. The first jump is announced as a teleport; the second one is a fast movement,
  // which the hair must follow late.
  expect(swing(0.05, true)).toBeLessThan(0.001);
  expect(swing(0, false)).toBeGreaterThan(0.003);
});

test("a page that slept goes on where it was", async () => {
  const { room, member, run } = await roomWithHead();
  run(1, (t) => 0.5 * Math.sin(8 * t));
  const before = member.points()!;
  // The page draws nothing for an hour. A LocalRoom advances by at most 0.1 s between two pictures.
  room.sample(5000 + 3_600_000);
  const since = member.points()!;
  let most = 0;
  for (let i = 0; i < before.length; ++i) most = Math.max(most, Math.abs(before[i] - since[i]));
  // The picture after the sleep has advanced by these 0.1 s, so the hair is not frozen either.
  expect(most).toBeGreaterThan(0.0005);
  // After a simulated hour the hair would hang at rest again.
  expect(awayFromRest(member)).toBeGreaterThan(0.003);
});

test("levels, materials and looks change while it moves", async () => {
  const { room, own, member, run } = await roomWithHead({ level: LevelIndex.medium, tag: "Ann" });
  expect(member.tagText).toBe("Ann");
  expect(member.level).toBe(LevelIndex.medium);
  for (const level of [LevelIndex.low, LevelIndex.ether, LevelIndex.high]) {
    own.setLevel(level);
    run(0.2, (t) => 0.3 * Math.sin(8 * t));
    expect(member.level).toBe(level);
  }
  own.setMaterial(materials.wet);
  const changed: string[] = [];
  room.on("changed", (event) => changed.push(event.member.tagText));
  own.setAppearance({ hairRoot: 0x123456 }, "Anna");
  run(0.1);
  expect(changed).toEqual(["Anna"]);
  expect(member.appearance.hairTip).toBe(0x123456);
  own.setLevel(LevelIndex.rigid);
  // The displacement fades for 0.3 s (kRigidEase_s of core/world/character.hpp) before the hair is rigid.
  run(1);
  expect(member.lattice).toBeNull();
});

test("wind moves hair, and still air lets it rest", async () => {
  const { room, member, run } = await roomWithHead();
  const winds: number[] = [];
  room.on("wind", ({ wind }) => winds.push(wind.meanMPerS[0]));
  // A wind of 5 m/s from +X blows towards -x.
  room.setWind({ speed: 5, from: 90 });
  run(1);
  expect(awayFromRest(member)).toBeGreaterThan(0.003);
  expect(room.wind.meanMPerS[0]).toBeCloseTo(-5);
  room.setWind({});
  run(12);
  expect(awayFromRest(member)).toBeLessThan(0.001);
  expect(winds).toEqual([-5, -0].map((speed) => expect.closeTo(speed)));
});

test("two characters of one hairstyle move by themselves; one leaves", async () => {
  const { room, own, member, run, add } = await roomWithHead();
  const left: number[] = [];
  room.on("left", (event) => left.push(event.member.member));
  const second = room.addCharacterLike(member);
  expect(second.character).toBe(2);
  run(0.05);
  // Nobody has pushed a pose of the second character yet.
  expect(second.member?.pose).toBeNull();
  second.push(rigidPose());
  run(1, (t) => 0.5 * Math.sin(8 * t));
  run(0.02);
  expect(awayFromRest(member)).toBeGreaterThan(0.005);
  // `run` turns only the heads that `add` knows: the second head rests, so its hair must not move with the first one.
  expect(awayFromRest(second.member!)).toBeLessThan(0.001);
  add(second);
  room.removeCharacter(own);
  run(0.5, (t) => 0.5 * Math.sin(8 * t));
  run(0.02);
  expect(left).toEqual([1]);
  expect([...room.members.keys()]).toEqual([2]);
  expect(awayFromRest(second.member!)).toBeGreaterThan(0.003);
});

test("without a file the levels are built, the same ones, and the hair is rigid until then", async () => {
  const { room, member, run } = await roomWithHead({ levels: undefined });
  expect(member.level).toBe(LevelIndex.rigid);
  expect(room.building).not.toBeNull();
  await until("levels are built", () => room.building === null);
  run(0.5, (t) => 0.5 * Math.sin(8 * t));
  expect(member.level).toBe(LevelIndex.high);
  // `buildLevels` in beforeAll has reported its progress, which grows and never exceeds 1.
  expect(reported.length).toBeGreaterThan(4);
  expect([...reported].sort((a, b) => a - b)).toEqual(reported);
  expect(reported.at(-1)).toBeLessThanOrEqual(1);

  // The file is the same as the one that the module builds itself, without `buildLevels`.
  const module = await localModule();
  const build = module.make("hairnet_build_begin", module.makeOf("hairnet_groom_load", groom));
  const file = module.allBytes("hairnet_levels_file", module.make("hairnet_build_finish", build));
  expect(Buffer.compare(file, levels)).toBe(0);
});

test("a page that has started hairnet.wasm has both, and grooms go from one to the other", async () => {
  // A fresh import of the package has started neither module.
  vi.resetModules();
  const { Groom } = await import("../../src/index");
  const hair = await Groom.load(groom);
  expect(hair.module.has("hairnet_world_make")).toBe(false);
  const room = await (await import("../../src/local/index")).LocalRoom.open();
  const own = room.addCharacter(hair, { levels });
  own.push(rigidPose());
  for (const nowMs of [0, 50, 100]) room.sample(nowMs);
  expect(own.member?.groomKey).toBe(hair.key);
  expect(own.member?.level).toBe(LevelIndex.high);
  expect(own.member?.points()).toHaveLength(hair.points.length);
});

test("what is wrong is refused in a line, and nothing is lost", async () => {
  const { room, own, member, run } = await roomWithHead();
  const other = await strandsFile(30);
  const damaged = levels.slice();
  // One bit in the middle of the file is flipped.
  damaged[levels.length >> 1] ^= 1;
  // The first file belongs to another hairstyle.
  expect(errorOf(() => room.addCharacter(other, { levels })).code).toBe("malformed");
  expect(errorOf(() => room.addCharacter(other, { levels: damaged })).code).toBe("malformed");
  expect(errorOf(() => room.addCharacter(other, { levels: "bob.levels" as never })).message).toContain(".levels file");
  expect(errorOf(() => room.addCharacter(groom.subarray(0, 100), { levels })).code).toBe("malformed");
  expect(errorOf(() => room.addCharacter(groom, { levls: levels } as never)).code).toBe("unknown_option");
  await expect(buildLevels(groom.subarray(0, 100))).rejects.toThrow(HairnetError);
  // The limits are those of hairnet_world_make.
  await expect(LocalRoom.open({ tickRateHz: 5 })).rejects.toThrow("10 to 240");
  const before = room.counters.inputsDropped;
  own.push(rigidPose([0, 0, 0, 1], [NaN, 0, 0]));
  room.setWind({ speed: NaN });
  room.sample(NaN);
  // The pose, the wind and the time of the picture were each dropped and counted.
  expect(room.counters.inputsDropped).toBe(before + 3);
  expect(room.members.size).toBe(1);
  run(1, (t) => 0.5 * Math.sin(8 * t));
  run(0.02);
  expect(awayFromRest(member)).toBeGreaterThan(0.005);
});

test("a closed room is empty, and takes nobody", async () => {
  const { room, own } = await roomWithHead();
  const states: string[] = [];
  room.on("state", ({ state }) => states.push(state));
  room.close();
  room.close();
  expect(states).toEqual(["closed"]);
  expect(room.sample(20_000)).toEqual([]);
  own.push(rigidPose());
  expect(errorOf(() => room.addCharacter(groom, { levels })).message).toContain("closed");
});
