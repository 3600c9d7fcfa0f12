// Clients of three kinds watch one hand hold hair: a page in Chromium, whose hand it is, a page in Firefox, and
// hairnet-view.
import { spawn, type ChildProcess } from "node:child_process";
import { once } from "node:events";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { Quaternion, Vector3 } from "three";
import { afterAll, afterEach, beforeAll, expect, test } from "vitest";
import type { PageViewer } from "../page/viewer";
import { LevelIndex, TouchAudience, type Groom, type Member } from "../src/index";
import { Actor, makeGroomFile } from "./actor";
import { Browser } from "./browser";
import type { HairNow, Moment, placeMoments } from "./deformPage";
import { Firefox } from "./firefox";
import { allNodes, latticeModel, readTrace, type LatticeModel, type TracedFrame } from "./frameTrace";
import { HairnetServer, program, until } from "./hairnetServer";
import { lockAt, type Lock } from "./lock";
import { cameraRests } from "./picture";
import { StageServer } from "./stageServer";

/**
 * All clients must place each point of the held hair within this distance of each other, m. Most of it is between
 * shaders, which place the native client's hair here, and the library, which places that of pages: 3 mm where hair is
 * pulled 16 cm off, and 0.5 mm where it hangs, with the same nodes.
 */
const kWithinM = 0.005;
/** Hair that is this far from where it hung is pulled, m. The hand goes further, because hair slips through it. */
const kPulledM = 0.05;
const kHandGoesM = 0.12;
/** The number of ticks that must be compared while hair is pulled, and after its release. */
const kTicksMin = 20;
/** The ball of a page's mouse holds hair within this distance (page/touch/pointerTouch.ts). */
const kHoldRadiusM = 0.03;
/**
 * The head turns evenly meanwhile, and so its turn names the tick: a page does not tell which ticks it shows. The speed
 * of 0.1 rad/s is 20 of a frame's steps of rotation a tick, and so slow that hair hardly swings by it.
 */
const kTurnRad = 0.6;
const kTurnS = 6;
/**
 * A tick whose head has turned by less than this since the tick before cannot be told from it. Usually it is 3.3e-3
 * rad.
 */
const kTurnMinRad = 1e-3;
/** Pages are looked at this often, a seventh of a tick. */
const kLookEveryMs = 5;
/** Between two looks that are further apart hair moves along a curve, and not along a line: half a tick. */
const kLookApartMsMax = 17;

/** One look at the held hair in a page. */
interface Look {
  readonly ms: number;
  /** The turn of the head about +Y, rad. */
  readonly turnRad: number;
  /** The points of the held hair, world, 3 numbers each. */
  readonly points: Float32Array;
}
/** What this test puts into the `window` of a page. */
interface Watching {
  hairnet: PageViewer;
  /** The numbers of the points to keep; empty: nothing is kept yet. */
  held: readonly number[];
  looks: Look[];
  /** The answer to the last hold: how many points the hand holds. */
  heldCount: number;
}
/** A page of Playwright or of Puppeteer. */
interface AnyPage {
  evaluate(script: string): Promise<unknown>;
}

/** Runs a function in a page of any browser. Argument and result travel as JSON. */
async function inPage<Argument, Result>(
  page: AnyPage,
  run: (argument: Argument) => Result,
  argument: Argument,
): Promise<Result> {
  const json = await page.evaluate(`JSON.stringify((${run})(${JSON.stringify(argument)}) ?? null)`);
  return JSON.parse(json as string) as Result;
}

/** Runs in a page. Returns whether it has drawn the member, and gets the hair of this level. */
function isShown([member, level]: readonly [number, LevelIndex]): boolean {
  const page = (window as unknown as Partial<Watching>).hairnet;
  const one = page?.served?.members.get(member);
  return !!page?.hair?.characters.get(member)?.isReady && one?.level === level && one.lattice !== null;
}

/**
 * Runs in a page. From now on the page draws no pictures, which take software too long, but samples the room as for a
 * picture, and keeps where the held hair is.
 */
function watch([member, everyMs]: readonly [number, number]): void {
  const watching = window as unknown as Watching;
  const { served, stage: drawing } = watching.hairnet;
  Object.assign(watching, { held: [], looks: [], heldCount: 0 });
  drawing.renderer.setAnimationLoop(null);
  // The server rounds frames the more, the smaller a head is on the screen. The native client does not tell a size, and
  // gets what a head that fills the screen has.
  served!.reportImportance([{ member, screenHeight: 1, inView: true }]);
  served!.on("held", ({ pointCount }) => (watching.heldCount = pointCount));
  setInterval(() => {
    served!.sample(performance.now());
    const one = served!.members.get(member);
    if (watching.held.length === 0 || !one?.pose || !one.lattice) return;
    const all = one.points()!;
    const points = Float32Array.from({ length: 3 * watching.held.length }, (_, i) => {
      return all[3 * watching.held[Math.floor(i / 3)] + (i % 3)];
    });
    watching.looks.push({ ms: performance.now(), turnRad: 2 * Math.atan2(one.pose[1], one.pose[3]), points });
  }, everyMs);
}

/** Runs in a page. It keeps these points from now on. */
function keep(held: readonly number[]): void {
  (window as unknown as Watching).held = held;
}

/** Runs in a page. Returns whether its user may touch the member's hair. */
function mayTouch(member: number): boolean {
  const room = (window as unknown as Watching).hairnet.served!;
  return room.mayTouch(room.members.get(member)!);
}

const heldCountIn = (page: AnyPage) => inPage(page, () => (window as unknown as Watching).heldCount, null);
const handCountIn = (page: AnyPage) =>
  inPage(page, () => (window as unknown as Watching).hairnet.served!.hands.size, null);

/**
 * Runs in a page. Returns the points of the held hair when the head had each of these turns; null where no two looks
 * are near enough to each other.
 */
function pointsAt([turnsRad, apartMsMax]: readonly [readonly number[], number]): (number[] | null)[] {
  const { looks } = window as unknown as Watching;
  return turnsRad.map((turnRad) => {
    const after = looks.findIndex((look) => look.turnRad >= turnRad);
    if (after < 1) return null;
    const [a, b] = [looks[after - 1], looks[after]];
    if (b.ms - a.ms > apartMsMax) return null;
    const s = (turnRad - a.turnRad) / (b.turnRad - a.turnRad);
    return Array.from(a.points, (x, i) => x + s * (b.points[i] - x));
  });
}

/**
 * Runs in the page of deformPage.ts. Returns where points are at each moment, head space. The name of a point is its
 * place at rest, because GPU and groom have points in different orders.
 */
async function placeHeld([hair, moments, names]: readonly [
  Omit<HairNow, keyof Moment>,
  readonly Moment[],
  readonly string[],
]): Promise<number[][]> {
  const page = window as unknown as { placeMoments: typeof placeMoments };
  const all = await page.placeMoments(hair, moments, { skin: true, lengths: true });
  const places = new Map<string, number>();
  for (let at = 0; at < all[0].length; at += 6) places.set(all[0].slice(at, at + 3).join(), at + 3);
  return all.map((points) => names.flatMap((name) => points.slice(places.get(name)!, places.get(name)! + 3)));
}

const server = new HairnetServer();
const browser = new Browser();
const firefox = new Firefox();
const groom = makeGroomFile("long_straight");
const folder = mkdtempSync(join(tmpdir(), "hairnet-trace-"));
let stage: StageServer;
let model: LatticeModel;
let actor: Actor;
let native: ChildProcess | undefined;
/** The test's pages, which must not slow down its second attempt. */
const opened: { close(): Promise<void> }[] = [];

const settle = (ms: number) => new Promise((done) => setTimeout(done, ms));

beforeAll(async () => {
  await server.start();
  await browser.start();
  [stage, model] = await Promise.all([
    StageServer.open(browser, "deformPage"),
    latticeModel(groom.path, folder),
    firefox.start(),
  ]);
  actor = await Actor.join(server.address, "three", groom.bytes, [0, 1.6, 0]);
  actor.room.setTouch(actor.own, TouchAudience.everyone);
});
afterEach(async () => {
  native?.kill("SIGKILL");
  for (const page of opened.splice(0)) await page.close();
});
afterAll(async () => {
  actor?.leave();
  await stage?.dispose();
  await browser.dispose();
  await firefox.dispose();
  await server.dispose();
  rmSync(folder, { recursive: true, force: true });
});

/** Starts the native client, which watches the room and writes a trace until it is asked to end. */
async function startNative(trace: string): Promise<ChildProcess> {
  const to = ["--connect", `127.0.0.1:${server.port}`, "--transport", "address", "--room", "three"];
  const started = spawn(program("hairnet-view"), [...to, "--observe", "all", "--trace", trace, "--duration", "600"], {
    stdio: ["ignore", "ignore", "pipe"],
  });
  let said = "";
  started.stderr.on("data", (text) => (said += String(text)));
  await until("the native client is connected", () => said.includes("connected over"));
  return started;
}

/** Waits until the owner's hair hangs still. */
async function hangsStill(member: Member): Promise<void> {
  let before = member.points()!;
  await until("the hair hangs still", async () => {
    await settle(500);
    const now = member.points()!;
    const movedM = now.reduce((most, x, i) => Math.max(most, Math.abs(x - before[i])), 0);
    before = now;
    return movedM < 0.001;
  });
}

/** Returns the numbers of all points of the strands that a hand holds at the lock. */
function heldPoints({ strandBegin }: Groom, points: Float32Array, { place }: Lock): number[] {
  const isNear = (point: number) => Math.hypot(...place.map((x, axis) => points[3 * point + axis] - x)) <= kHoldRadiusM;
  return Array.from(strandBegin.subarray(1), (end, strand) => {
    const own = Array.from({ length: end - strandBegin[strand] }, (_, i) => strandBegin[strand] + i);
    return own.some(isNear) ? own : [];
  }).flat();
}

/** Returns the frames with hair whose head has turned on since the frame before. */
function turningFrames(frames: readonly TracedFrame[]): (TracedFrame & { readonly turnRad: number })[] {
  let beforeRad = 0;
  return frames
    .map((frame) => ({ ...frame, turnRad: 2 * Math.atan2(frame.pose[1], frame.pose[3]) }))
    .filter(({ turnRad, displacements, isDiscontinuous }) => {
      const turnsOn = turnRad - beforeRad > kTurnMinRad;
      beforeRad = turnRad;
      return turnsOn && displacements.length > 0 && !isDiscontinuous;
    });
}

/** Returns where points of head space are in the world. */
function inWorld(points: readonly number[], pose: readonly number[]): number[] {
  const [turn, head] = [new Quaternion().fromArray(pose), new Vector3().fromArray(pose, 4)];
  const point = new Vector3();
  return points.flatMap((_, i) =>
    i % 3 === 0 ? point.fromArray(points, i).applyQuaternion(turn).add(head).toArray() : [],
  );
}

/** Returns the largest distance between a point of one list and the same point of the other, m. */
function farthestM(a: readonly number[], b: readonly number[]): number {
  if (a.length !== b.length || a.length === 0) return Infinity;
  let most = 0;
  for (let i = 0; i < a.length; i += 3)
    most = Math.max(most, Math.hypot(a[i] - b[i], a[i + 1] - b[i + 1], a[i + 2] - b[i + 2]));
  return most;
}

test("Chromium, Firefox and the native client place held hair alike, at the same ticks", async () => {
  actor.yawRad = 0;
  const trace = mkdtempSync(join(folder, "trace-"));
  native = await startNative(trace);
  const pages = await Promise.all([
    browser.open(`${server.address}/?room=three`),
    firefox.open(`${server.address}/?room=three&observe`),
  ]);
  opened.push(...pages);
  const [chromium] = pages;
  await until("the owner has hair", () => !!actor.own.member?.skin && actor.own.member.lattice !== null);
  const member = actor.own.member!;
  for (const page of pages)
    await until("the page shows it", () => inPage(page, isShown, [member.member, LevelIndex.high] as const));
  await chromium.evaluate((number) => (window as unknown as Watching).hairnet.focus.show(number), member.member);
  await cameraRests(chromium);
  for (const page of pages) await inPage(page, watch, [member.member, kLookEveryMs] as const);
  await until("the hair may be touched", () => inPage(chromium, mayTouch, member.member));
  await hangsStill(member);

  const lock = await lockAt(chromium, member.member);
  const held = heldPoints(member.groom!, member.points()!, lock);
  for (const page of pages) await inPage(page, keep, held);
  await chromium.mouse.move(lock.x, lock.y);
  await chromium.mouse.down();
  await until("the hand holds hair", async () => (await heldCountIn(chromium)) > 0);
  await until("Firefox sees the hand", async () => (await handCountIn(pages[1])) === 1);
  const turned = actor.turnTo(kTurnRad, kTurnS);
  // The mouse goes aside in 20 moves within a second, as a person's hand does.
  for (let move = 1; move <= 20; ++move) {
    await chromium.mouse.move(lock.x + (move / 20) * kHandGoesM * lock.pxPerM, lock.y);
    await settle(40);
  }
  // The hair hangs from the hand for more than kTicksMin ticks of 1/30 s, and later swings back for as long.
  await settle(1500);
  const releasedRad = actor.yawRad;
  await chromium.mouse.up();
  await turned;
  await settle(500);
  const ended = once(native, "exit");
  native.kill("SIGTERM");
  expect((await ended)[0]).toBe(0);

  const traced = readTrace(trace);
  expect(new Set(traced.map(({ character }) => character)).size).toBe(1);
  const frames = turningFrames(traced);
  const turnsRad = frames.map(({ turnRad }) => turnRad);
  const [inChromium, inFirefox] = await Promise.all(
    pages.map((page) => inPage(page, pointsAt, [turnsRad, kLookApartMsMax] as const)),
  );
  const rest = member.groom!.points;
  const names = held.map((point) => rest.slice(3 * point, 3 * point + 3).join());
  const skin = { ...member.skin!, nodes: [...member.skin!.nodes] };
  const moments = frames.map(({ pose, displacements }) => ({ pose, nodes: allNodes(model, displacements) }));
  const placed = await stage.page.evaluate(placeHeld, [
    { file: [...groom.bytes], lattice: model.lattice, skin },
    moments,
    names,
  ] as Parameters<typeof placeHeld>[0]);
  const inNative = placed.map((points, n) => inWorld(points, frames[n].pose));

  /** Compares the ticks that all clients show. `shift`: the native client's tick is so many ticks later. */
  const compare = (shift: number) =>
    frames.flatMap(({ turnRad }, n) => {
      const seen = [inChromium[n], inFirefox[n], inNative[n + shift]];
      if (!seen[0] || !seen[1] || !seen[2]) return [];
      const [a, b, c] = seen as number[][];
      const awayM = farthestM(placed[n], placed[0]);
      return [{ turnRad, awayM, apartM: Math.max(farthestM(a, b), farthestM(b, c), farthestM(a, c)) }];
    });
  const ticks = compare(0);
  const pulled = ticks.filter(({ turnRad, awayM }) => turnRad < releasedRad && awayM > kPulledM);
  const released = ticks.filter(({ turnRad }) => turnRad > releasedRad);
  const most = (list: readonly number[]) => (1000 * Math.max(0, ...list)).toFixed(2);
  const apartMm = (list: typeof ticks) => most(list.map(({ apartM }) => apartM));
  console.log(
    `${held.length} points of held hair, up to ${most(pulled.map(({ awayM }) => awayM))} mm off; clients differ by ` +
      `${apartMm(ticks)} mm in ${ticks.length} of ${frames.length} ticks, by ${apartMm(pulled)} mm in ` +
      `${pulled.length} while it is pulled, by ${apartMm(released)} mm in ${released.length} after its release; with ` +
      `ticks that are three apart by ${apartMm(compare(3))} mm`,
  );
  expect(pulled.length).toBeGreaterThanOrEqual(kTicksMin);
  expect(released.length).toBeGreaterThanOrEqual(kTicksMin);
  expect(Math.max(...ticks.map(({ apartM }) => apartM))).toBeLessThan(kWithinM);
  // The hair is back, so that the ticks after the release had a motion to agree on.
  expect(released.at(-1)!.awayM).toBeLessThan(kPulledM);
  // Ticks that differ are seen as such.
  expect(Math.max(...compare(3).map(({ apartM }) => apartM))).toBeGreaterThan(kWithinM);
  expect(browser.takeErrors()).toEqual([]);
});
