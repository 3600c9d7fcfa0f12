import { mkdirSync } from "node:fs";
import { afterAll, beforeAll, expect, test } from "vitest";
import type { PageViewer } from "../page/viewer";
import { Actor, makeGroomFile } from "./actor";
import { Browser } from "./browser";
import { HairnetServer, until } from "./hairnetServer";
import { SlowLine } from "./slowLine";

// A usual home's line, and a room of five with hairstyles of the usual size.
const kBitsPerS = 10e6;
const kOneWayMs = 25;
const kStrands = 10_000;
const kStyles = ["long_straight", "bob", "long_curly", "ponytail", "wavy"];
const kCentral = 2;
/** What may pass before the first hair: 3 s of the line, less a second for everything else. */
const kBytesMax = (2 * kBitsPerS) / 8;

const server = new HairnetServer();
const browser = new Browser();
const actors: Actor[] = [];
const shots = process.env.HAIRNET_SHOTS ?? "e2e/shots";
let line: SlowLine;

type Globals = { hairnet: PageViewer; firstHair: { ms: number; member: number }; tellFirstHair(): Promise<void> };

beforeAll(async () => {
  mkdirSync(shots, { recursive: true });
  await server.start();
  line = new SlowLine(server.port, kBitsPerS, kOneWayMs);
  await line.start();
  for (const [n, style] of kStyles.entries()) {
    const { bytes } = makeGroomFile(style, kStrands);
    actors.push(await Actor.join(server.address, "five", bytes, [0.6 * (n - kCentral), 1.6, 0]));
  }
  await browser.start({ width: 1280, height: 720 });
}, 240_000);
afterAll(async () => {
  for (const actor of actors) actor.leave();
  await browser.dispose();
  line.dispose();
  await server.dispose();
});

test("on a slow line the person of the first view has hair before anyone else's is asked for", async () => {
  const page = await browser.open("about:blank");
  const before = line.bytes;
  let bytes = 0;
  await page.exposeFunction("tellFirstHair", () => (bytes = line.bytes - before));
  await page.addInitScript(() => {
    const look = () => {
      const { hairnet, tellFirstHair } = window as unknown as Globals;
      const ready = [...(hairnet?.hair?.characters.values() ?? [])].find((one) => one.isReady);
      if (!ready) {
        requestAnimationFrame(look);
        return;
      }
      Object.assign(window, { firstHair: { ms: performance.now(), member: ready.member } });
      void tellFirstHair();
    };
    requestAnimationFrame(look);
  });
  await page.goto(`http://127.0.0.1:${line.port}/?room=five`, { waitUntil: "commit" });
  await until("hair is drawn", () => Promise.resolve(bytes > 0), 60_000);
  const found = await page.evaluate(() => {
    const { firstHair, hairnet } = window as unknown as Globals;
    const x = hairnet.room!.members.get(firstHair.member)!.pose![4];
    return { ms: firstHair.ms, isShown: hairnet.focus.person === firstHair.member, x };
  });
  console.log(`first hair after ${found.ms.toFixed(0)} ms and ${(bytes / 1000).toFixed(0)} kB`);
  expect(found.isShown).toBe(true);
  expect(found.x).toBeCloseTo(0, 1);
  expect(bytes).toBeLessThan(kBytesMax);
  await page.screenshot({ path: `${shots}/first_hair.png`, timeout: 90_000 });
  expect(browser.takeFaults()).toEqual([]);
});
