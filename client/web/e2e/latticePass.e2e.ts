import { afterAll, beforeAll, expect, test } from "vitest";
import { Browser } from "./browser";
import type { compareNodes } from "./latticePage";
import { StageServer } from "./stageServer";

const browser = new Browser();
let server: StageServer | undefined;
beforeAll(async () => {
  await browser.start();
  server = await StageServer.open(browser, "latticePage");
});
afterAll(async () => {
  await browser.dispose();
  await server?.dispose();
});

test("the GPU sums up the modes of several bases as the CPU does, and takes nodes that are uploaded", async () => {
  const { apartM, movedM, error } = await server!.page.evaluate(() =>
    (window as unknown as { compareNodes: typeof compareNodes }).compareNodes(),
  );
  console.log(`nodes within ${Math.max(...apartM).toExponential(1)} m, of up to ${movedM.toFixed(2)} m`);
  expect(error).toBe(0);
  expect(apartM).toHaveLength(11);
  expect(movedM).toBeGreaterThan(0.3);
  expect(Math.max(...apartM)).toBeLessThan(1e-5);
});
