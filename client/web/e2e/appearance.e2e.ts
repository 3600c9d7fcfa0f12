import { mkdirSync } from "node:fs";
import { afterAll, beforeAll, expect, test } from "vitest";
import type { Page } from "playwright-core";
import { Actor, makeGroomFile } from "./actor";
import { Browser } from "./browser";
import { HairnetServer, until } from "./hairnetServer";
import { readyCount, takePicture, type PageGlobals } from "./picture";

const server = new HairnetServer();
const browser = new Browser();
const shots = process.env.HAIRNET_SHOTS ?? "e2e/shots";
const actors: Actor[] = [];

beforeAll(async () => {
  mkdirSync(shots, { recursive: true });
  await server.start();
  await browser.start({ width: 640, height: 400 });
});
afterAll(async () => {
  for (const actor of actors) actor.leave();
  await browser.dispose();
  await server.dispose();
});

/**
 * The shares of pixels that are clearly red, green and blue. In such a pixel one colour is 1.5 times as bright as both
 * others, and 20 of 255 brighter: grey, skin and brown have none.
 */
async function shares(page: Page): Promise<number[]> {
  const { pixels } = await takePicture(page);
  const counts = [0, 0, 0];
  for (let p = 0; p < pixels.length; p += 4) {
    for (let c = 0; c < 3; ++c) {
      const others = [0, 1, 2].filter((each) => each !== c).map((each) => pixels[p + each]);
      if (pixels[p + c] > 1.5 * Math.max(...others) + 20) ++counts[c];
    }
  }
  return counts.map((count) => count / (pixels.length / 4));
}

test("everyone is drawn in the colours that they chose, from the root to the tip, and in new ones at once", async () => {
  const groom = makeGroomFile("long_straight");
  const look = { hairRoot: 0xe01010, hairTip: 0x1010e0, skin: 0xe1bfad, roughness: 0.4 };
  actors.push(await Actor.join(server.address, "who", groom.bytes, [0, 1.6, 0], { tag: "Ann", appearance: look }));
  const page = await browser.open(`${server.address}/?room=who&observe`);
  await until("she is ready", async () => (await readyCount(page)) === 1);
  const colours = () =>
    page.evaluate(() => {
      const { hair } = (window as unknown as { hairnet: PageGlobals }).hairnet;
      return [...hair!.characters.values()].map((one) => [
        one.hairColour.getHex(),
        one.hairTipColour?.getHex() ?? null,
        one.skinColour.getHex(),
      ]);
    });
  expect(await colours()).toEqual([[look.hairRoot, look.hairTip, look.skin]]);
  await until("red roots and blue tips are in the picture", async () => {
    const [red, , blue] = await shares(page);
    // Roots and tips are small parts of the picture, so few pixels are clearly red or blue.
    return red > 0.002 && blue > 0.002;
  });
  await page.screenshot({ path: `${shots}/who-red-to-blue.png`, timeout: 90_000 });
  actors[0].own.setAppearance({ hairRoot: 0x10c010 });
  await until("the hair is green", async () => {
    const [red, green, blue] = await shares(page);
    // Root and tip are green now, so twice as many pixels are green, and next to none keeps an old colour.
    return green > 0.004 && red < 0.002 && blue < 0.002;
  });
  // A new root alone colours the whole hair, so the tip has no colour of its own (null).
  expect(await colours()).toEqual([[0x10c010, null, look.skin]]);
  await page.screenshot({ path: `${shots}/who-green.png`, timeout: 90_000 });
  expect(browser.takeErrors()).toEqual([]);
});
