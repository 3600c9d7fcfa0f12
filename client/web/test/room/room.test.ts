import { afterAll, afterEach, beforeAll, expect, test } from "vitest";
import { LevelIndex, materials, nodeCount, rigidPose, type Member } from "../../src/index";
import { strandsFile } from "../support/grooms";
import { Person } from "../support/person";
import { Server } from "../support/server";
import { until } from "../support/until";

// The server's own wind, in m/s.
const server = new Server(["--wind", "1", "0", "2"]);
const people: Person[] = [];
const join = async (room: string) => {
  const person = await Person.join(server.address, { room });
  people.push(person);
  return person;
};
/** Joins someone who has a character of that name; `shape` are the arguments of `madeStrands`. */
const wearer = async (room: string, tag: string, ...shape: Parameters<typeof strandsFile>) => {
  const person = await join(room);
  person.own = person.room.addCharacter(await strandsFile(...shape), { tag });
  return person;
};
/** The largest displacement of a node of its lattice along an axis, m. */
const swing = ({ lattice }: Member) => (lattice ? Math.max(...lattice.grid.map(Math.abs)) : 0);
/** The largest coordinate of these points, m. It tells where a character stands. */
const far = (points: Float32Array) => Math.max(...points.map(Math.abs));

beforeAll(() => server.start());
afterEach(() => {
  for (const person of people.splice(0)) person.leave();
});
afterAll(() => server.dispose());

test("two people see each other: head, hairstyle, and hair that moves", async () => {
  const ann = await wearer("two", "Ann", 20, 6);
  const ben = await wearer("two", "Ben", 20, 6);
  const seen = await ben.meets("Ann");
  // Hair is rigid, with displacements of 0, until the server has built its levels. A millimetre means that it is
  // simulated.
  await until("her hair moves", () => swing(seen) > 1e-3);
  expect(seen).toMatchObject({ own: false, character: 0, ownerCharacter: ann.own!.character, error: "" });
  expect(seen.session).toBe(ann.room.session);
  expect(ben.room.memberOf(ann.room.session, ann.own!.character)).toBe(seen);
  expect(seen.delayS).toBeGreaterThan(0);

  const { groom, lattice, skin, pose } = seen;
  expect(groom!.key).toBe(seen.groomKey);
  expect(groom!.file).toEqual(await strandsFile(20, 6));
  expect([...pose!.subarray(4, 7)]).toEqual([0, 1.6, 0].map((x) => expect.closeTo(x, 3)));
  expect(lattice!.grid).toHaveLength(3 * nodeCount(lattice!.lattice));
  expect(lattice!.modes!.coefficients.length).toBeGreaterThan(0);
  expect(lattice!.modes!.coefficients.length).toBeLessThanOrEqual(lattice!.modes!.basis.modeCount);
  // A GPU sums up the modes by their coefficients. The sum must be what the grid has, here along x for the first 10
  // nodes. The texels have 4 numbers for each node, and modes of zeros at the end (`Basis.texels`).
  const { basis, coefficients } = lattice!.modes!;
  const texels = basis.texels();
  const modeFloats = texels.length / (4 * Math.ceil(basis.modeCount / 4));
  const sums = Array.from({ length: 10 }, (_, node) =>
    coefficients.reduce((sum, c, k) => sum + c * texels[k * modeFloats + 4 * node], 0),
  );
  expect(sums).toEqual(Array.from({ length: 10 }, (_, node) => expect.closeTo(lattice!.grid[3 * node], 5)));
  expect(skin!.nodes.length).toBe(4 * skin!.grids.reduce((sum, { dims: [x, y, z] }) => sum + x * y * z, 0));
  const points = seen.points()!;
  expect(points).toHaveLength(3 * groom!.pointCount);
  // The head joint is at a height of 1.6 m, and all of the head is within 0.4 m above it.
  expect(far(points)).toBeGreaterThan(1.6);
  expect(far(points)).toBeLessThan(2);
  expect(seen.points(points)).toBe(points);

  // The server may send a larger error for a head that is small on the screen (`RoomOptions.errorM`): at a thousandth
  // of the screen's height a thousand times as much. Then a few coefficients are enough, where a head that fills the
  // screen has more than 60.
  const sent = () => seen.lattice!.modes!.coefficients.filter((c) => c !== 0).length;
  await until("many are sent", () => sent() > 60);
  ben.room.reportImportance([
    { member: seen.member, screenHeight: 0.001, inView: true },
    // Nobody has this number: an application may report members that have just left.
    { member: 999, screenHeight: 1, inView: true },
  ]);
  await until("few are sent", () => sent() < 10);
  ben.room.reportImportance([{ member: seen.member, screenHeight: 1, inView: true }]);
  await until("many are sent again", () => sent() > 60);

  // Her own picture has her newest pose at once, without the way to the server and back.
  const mine = ann.own!.member!;
  expect(mine).toMatchObject({ own: true, character: ann.own!.character, groom: { key: seen.groomKey } });
  ann.moves = false;
  const pushed = rigidPose([0, 0, 0, 1], [1, 2, 3]);
  ann.own!.push(pushed, true);
  ann.room.sample(0);
  expect(mine.pose).toEqual(pushed);
  expect(ann.own!.newestPose).toEqual(pushed);

  // The groom, the skin and the modes of one hairstyle are the same objects for all who have it.
  const bens = ben.own!.member!;
  await until("his hair moves", () => swing(bens) > 1e-3);
  expect(bens.groom).toBe(groom);
  expect(bens.skin).toBe(skin);
  expect(bens.lattice!.modes!.basis).toBe(basis);
  expect(ben.room.counters).toMatchObject({ framesUndecodable: 0, inputsDropped: 0, reconnects: 0 });
  expect(ben.room.counters.framesReceived).toBeGreaterThan(10);
});

test("what an owner changes of its character reaches everyone, and its removal", async () => {
  const ann = await wearer("changes", "Ann", 20, 6);
  const ben = await join("changes");
  const seen = await ben.meets("Ann");
  await until("her hair moves", () => swing(seen) > 1e-3);
  ann.own!.setLevel(LevelIndex.low);
  await until("its level is another", () => seen.level === LevelIndex.low);
  ann.own!.setMaterial(materials.gel);
  const other = ann.room.addCharacterLike(ann.own!.member!, { tag: "Anna", level: LevelIndex.rigid });
  // A character is visible after its first pose.
  other.push(rigidPose([0, 0, 0, 1], [5, 1.6, 0]));
  const second = await ben.meets("Anna");
  await until("it stands there", () => second.pose !== null && second.groom !== null);
  expect(second).toMatchObject({ groomKey: seen.groomKey, level: LevelIndex.rigid, lattice: null });
  expect([...second.pose!.subarray(4, 7)]).toEqual([5, 1.6, 0].map((x) => expect.closeTo(x, 3)));
  // The second character stands at x = 5.
  expect(far(second.points()!)).toBeGreaterThan(4.9);

  ann.room.removeCharacter(other);
  expect(other.member).toBeNull();
  await until("it has left", () => ben.named("Anna") === undefined);
  expect(ben.named("Ann")).toBe(seen);
  // A listener that was removed must not hear the departure that follows.
  const stop = ben.room.on("left", () => expect.unreachable());
  stop();
  ann.leave();
  await until("both have left", () => ben.room.members.size === 0);
  const met = ben.heard.filter((line) => line !== "connected");
  expect(met).toEqual(["joined Ann", "joined Anna", "left Anna", "left Ann"]);
  expect(ann.heard.filter((line) => line.startsWith("error"))).toEqual([]);
});

test("of grooms the one that is named is fetched first, and no other until that is allowed", async () => {
  // Strands of 6 and of 8 points make two grooms, so that there are two files to fetch.
  const ann = await wearer("grooms", "Ann", 20, 6);
  const ben = await wearer("grooms", "Ben", 20, 8);
  for (const { own } of [ann, ben]) await until("the server has their hair", () => own!.member !== null);
  const { room } = await join("grooms");
  room.fetchesOnlyFirst = true;
  const joined: Member[] = [];
  room.on("joined", ({ member }) => joined.push(member));
  await until("both are met", () => joined.length === 2);
  // Ben's groom is asked for first, although Ann came first.
  const [first, other] = [...joined].sort((a, b) => b.tagText.localeCompare(a.tagText));
  expect(first.tagText).toBe("Ben");
  room.fetchFirst(first.member);
  await until("the first is here", () => first.groom !== null);
  expect(other.groom).toBeNull();
  const { bytes, byteCount } = room.downloads;
  expect(bytes).toBe(first.groom!.file.length);
  expect(byteCount).toBe(bytes);
  room.fetchesOnlyFirst = false;
  await until("the other is here, too", () => other.groom !== null);
});

test("the wind is the server's until someone sets another, and again when they leave", async () => {
  const ann = await join("wind");
  const ben = await join("wind");
  expect(ann.room.maySetWind).toBe(true);
  await until("she knows the server's", () => ann.room.wind.meanMPerS[0] === 1);
  expect(ann.room.wind.meanMPerS).toEqual([1, 0, 2]);
  const announced: [readonly number[], bigint][] = [];
  ann.room.on("wind", ({ wind, session }) => announced.push([wind.meanMPerS, session]));
  const full = {
    meanMPerS: [1, 2, 3],
    gustRatio: 0.5,
    gustPeriodS: 2,
    turbulenceRmsMPerS: 0.25,
    turbulenceScaleM: 1,
    seed: 7n,
    carried: true,
  } as const;
  ben.room.setWind(full);
  await until("she is told", () => announced.length === 1);
  expect(ann.room.wind).toEqual(full);
  ben.leave();
  await until("she is told again", () => announced.length === 2);
  expect(ann.room.wind.meanMPerS).toEqual([1, 0, 2]);
  expect(announced).toEqual([
    [[1, 2, 3], ben.room.session],
    [[1, 0, 2], 0n],
  ]);
});
