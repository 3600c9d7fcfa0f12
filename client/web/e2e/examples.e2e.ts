import { mkdirSync } from "node:fs";
import { createServer } from "node:net";
import type { AddressInfo } from "node:net";
import type { Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, describe, expect, test } from "vitest";
import { Browser } from "./browser";
import { areExamplesInstalled, ExampleRun, readPage } from "./exampleRun";
import { until } from "./hairnetServer";
import { shareChanged, shareWarm, type Picture } from "./picture";

const shots = process.env.HAIRNET_SHOTS ?? "e2e/shots";
const browser = new Browser();
let port = 0;
let run: ExampleRun;

if (!areExamplesInstalled)
  console.warn("client/web/examples are NOT TESTED: their packages are missing; deploy/web --examples installs them");

/** A port that is free now, for servers one after the other. */
function freePort(): Promise<number> {
  return new Promise((done) => {
    const probe = createServer();
    probe.listen(0, "127.0.0.1", () => {
      const { port: found } = probe.address() as AddressInfo;
      probe.close(() => done(found));
    });
  });
}

/** What the page shows, whatever draws it. */
async function look(page: Page, name: string): Promise<Picture> {
  const png = await page.screenshot({ path: `${shots}/example_${name}.png`, timeout: 90_000 });
  return page.evaluate(async (data) => {
    const picture = await createImageBitmap(await (await fetch(`data:image/png;base64,${data}`)).blob());
    const canvas = document.createElement("canvas");
    canvas.width = picture.width;
    canvas.height = picture.height;
    const context = canvas.getContext("2d")!;
    context.drawImage(picture, 0, 0);
    const { data: pixels } = context.getImageData(0, 0, canvas.width, canvas.height);
    return { width: canvas.width, height: canvas.height, pixels: Array.from(pixels) };
  }, png.toString("base64"));
}

describe.skipIf(!areExamplesInstalled)("the page of the example, followed word for word, shows hair that moves", () => {
  beforeAll(async () => {
    mkdirSync(shots, { recursive: true });
    port = await freePort();
    // The pages say port 7420, which another server of this machine may have.
    await browser.start({ width: 480, height: 360 }, [`--host-resolver-rules=MAP localhost:7420 127.0.0.1:${port}`]);
  });
  afterEach(async () => {
    await browser.closePages();
    await run.dispose();
  });
  afterAll(() => browser.dispose());

  test.each(["minimal", "vrm", "react-three-fiber", "babylon", "script", "aframe"])("%s", async (name) => {
    run = new ExampleRun();
    const address = await run.start(readPage(name), port);
    const page = await browser.open(String(address));
    let before: Picture;
    await until(
      "hair is in the picture",
      async () => {
        expect(browser.faults).toEqual([]);
        before = await look(page, name);
        return shareWarm(before) > 0.05;
      },
      90_000,
    );
    await until("it moves", async () => shareChanged(before, await look(page, name)) > 0.01, 30_000);
    expect(browser.takeFaults()).toEqual([]);
  });
});
