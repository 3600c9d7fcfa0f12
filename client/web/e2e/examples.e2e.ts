import { existsSync, mkdirSync } from "node:fs";
import type { Page } from "playwright-core";
import { PNG } from "pngjs";
import { afterAll, afterEach, beforeAll, beforeEach, describe, expect, inject, test } from "vitest";
import { Browser } from "./browser";
import { areExamplesInstalled, ExampleRun, readPage } from "./exampleRun";
import { until } from "./hairnetServer";
import { shareChanged, shareWarm, type Picture } from "./picture";

const shots = process.env.HAIRNET_SHOTS ?? "e2e/shots";
/** Small: a browser that draws in software takes seconds for a large picture. */
const kSize = { width: 240, height: 180 };
const browser = new Browser();
const port = inject("examplePort");
let run: ExampleRun;

if (!areExamplesInstalled)
  console.warn("client/web/examples are NOT TESTED: their packages are missing; deploy/web --examples installs them");

/** What the page shows, whatever draws it. */
async function look(page: Page, name: string): Promise<Picture> {
  const { width, height, data } = PNG.sync.read(
    await page.screenshot({ path: `${shots}/example_${name}.png`, timeout: 90_000 }),
  );
  return { width, height, pixels: data };
}

/** Opens a page that is to show hair that moves, and waits until it does. */
async function watch(name: string, address: URL): Promise<void> {
  const page = await browser.open(String(address));
  let before: Picture;
  await until(
    "hair is in the picture",
    async () => {
      expect(browser.errors).toEqual([]);
      before = await look(page, name);
      // Hair and skin cover a twentieth of the picture, which an empty scene never has.
      return shareWarm(before) > 0.05;
    },
    90_000,
  );
  // The examples' heads turn, so soon more than a hundredth of the pixels is another.
  await until("it moves", async () => shareChanged(before, await look(page, name)) > 0.01, 30_000);
  expect(browser.takeErrors()).toEqual([]);
}

beforeAll(async () => {
  if (!existsSync("dist/index.js")) throw new Error("client/web/dist is missing: npm run build");
  mkdirSync(shots, { recursive: true });
  await browser.start(kSize, 1);
});
beforeEach(() => {
  browser.takeErrors();
  run = new ExampleRun();
});
afterEach(async () => {
  await browser.closePages();
  await run.dispose();
});
afterAll(() => browser.dispose());

describe.skipIf(!areExamplesInstalled)("the page of the example, followed word for word, shows hair that moves", () => {
  test.each(["minimal", "vrm", "react-three-fiber", "babylon", "script", "aframe"])("%s", async (name) => {
    await watch(name, await run.start(readPage(name), port));
  });
});

test("the program of the package's page shows hair that moves, built in a project of its own", async () => {
  await watch("project", await run.startProject(port));
});
