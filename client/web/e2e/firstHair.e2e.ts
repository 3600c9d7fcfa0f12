import { mkdirSync } from "node:fs";
import { afterAll, beforeAll, expect, test } from "vitest";
import type { PageViewer } from "../page/viewer";
import { Actor, makeGroomFile } from "./actor";
import { Browser } from "./browser";
import { HairnetServer, until } from "./hairnetServer";
import { FirstSeen } from "./firstSeen";
import { SlowLine } from "./slowLine";

// The line has a tenth of a usual home's rate. The room has five people with few strands each, because the levels of
// usual hairstyles take minutes to build.
const kBitsPerS = 1e6;
const kOneWayMs = 25;
/** A server with sanitizers builds the levels of all five hairstyles in some minutes. */
const kBuildMs = 400_000;
const kStyles = ["long_straight", "bob", "long_curly", "ponytail", "wavy"];
/** The index of the style whose owner stands in the middle, at x = 0. */
const kCentral = 2;
/** What may pass before the first hair: more than the page and one groom, less than the page and three. */
const kBytesMax = 600_000;

const server = new HairnetServer();
const browser = new Browser();
const actors: Actor[] = [];
const shots = process.env.HAIRNET_SHOTS ?? "e2e/shots";
let line: SlowLine;

interface Globals {
  hairnet: PageViewer;
  /** The members whose groom arrived first and whose hair was drawn first, and when, ms from navigation. */
  first: { groomOf: number; hairOf: number; hairMs: number };
  tellGroom(): Promise<void>;
}

beforeAll(async () => {
  mkdirSync(shots, { recursive: true });
  await server.start();
  line = new SlowLine(server.port, kBitsPerS, kOneWayMs);
  await line.start();
  for (const [n, style] of kStyles.entries()) {
    const { bytes } = makeGroomFile(style);
    actors.push(await Actor.join(server.address, "five", bytes, [0.6 * (n - kCentral), 1.6, 0]));
  }
  await until(
    "the server has built all levels",
    async () => {
      const [grooms, waiting] = await Promise.all(
        ["hairnet_grooms", "hairnet_grooms_waiting"].map((each) => server.metric(each)),
      );
      return grooms === kStyles.length && waiting === 0;
    },
    kBuildMs,
  );
  await browser.start({ width: 1280, height: 720 });
}, kBuildMs + 60_000);
afterAll(async () => {
  for (const actor of actors) actor.leave();
  await browser.dispose();
  line.dispose();
  await server.dispose();
});

test("on a slow line the person of the first view has hair before anyone else's is asked for", async () => {
  const page = await browser.open("about:blank");
  const seen = await FirstSeen.watch(page);
  const before = line.bytes;
  let groomBytes = 0;
  await page.exposeFunction("tellGroom", () => (groomBytes = line.bytes - before));
  // Before each picture the page is asked which groom has come first, and whose hair can be drawn first.
  await page.addInitScript(() => {
    let groomOf = 0;
    const look = () => {
      const { hairnet, tellGroom } = window as unknown as Globals;
      const withGroom = [...(hairnet?.room?.members.values() ?? [])].find((one) => one.groom);
      if (withGroom && groomOf === 0) {
        groomOf = withGroom.member;
        void tellGroom();
      }
      const ready = [...(hairnet?.hair?.characters.values() ?? [])].find((one) => one.isReady);
      if (ready) Object.assign(window, { first: { groomOf, hairOf: ready.member, hairMs: performance.now() } });
      else requestAnimationFrame(look);
    };
    requestAnimationFrame(look);
  });
  await page.goto(`http://127.0.0.1:${line.port}/?room=five`, { waitUntil: "commit" });
  await page.waitForFunction(() => "first" in window, null, { timeout: 60_000, polling: 50 });
  const found = await page.evaluate(() => {
    const { first, hairnet } = window as unknown as Globals;
    return {
      ...first,
      originMs: performance.timeOrigin,
      shown: hairnet.focus.person,
      x: hairnet.room!.members.get(first.hairOf)!.pose![4],
    };
  });
  const seenMs = (await seen.epochMs) - found.originMs;
  console.log(
    `the first groom after ${(groomBytes / 1000).toFixed(0)} kB; ms from navigation: hair is ready after ` +
      `${found.hairMs.toFixed(0)}, is seen after ${seenMs.toFixed(0)}`,
  );
  // The first hair is that of the person in the middle, whom the camera shows, and whose groom was fetched first.
  expect(found.x).toBeCloseTo(0, 1);
  expect(found.hairOf).toBe(found.shown);
  expect(found.groomOf).toBe(found.shown);
  // With more bytes the page would have fetched others' grooms before that of the person it shows.
  expect(groomBytes).toBeLessThan(kBytesMax);
  await page.screenshot({ path: `${shots}/first_hair.png`, timeout: 90_000 });
  expect(browser.takeErrors()).toEqual([]);
});
