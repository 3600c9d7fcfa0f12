// Compares the averages of `Picture` with a reference of many samples a pixel. All figures are mean squared
// differences, as shares of the one of a single picture.
import { dirname } from "node:path";
import { afterAll, beforeAll, expect, test } from "vitest";
import { makeGroomFile } from "./actor";
import type { AverageStage, difference } from "./averagePage";
import { Browser } from "./browser";
import { StageServer } from "./stageServer";

const browser = new Browser(true);
const grooms = ["long_curly", "long_straight"].map((style) => makeGroomFile(style, 1500).path);
let server: StageServer | undefined;

interface Globals {
  AverageStage: typeof AverageStage;
  difference: typeof difference;
}

beforeAll(async () => {
  await browser.start();
  server = await StageServer.open(browser, "averagePage", grooms.map(dirname));
});
afterAll(async () => {
  await browser.dispose();
  await server?.dispose();
});

test.each([
  ["dark curls", grooms[0], 0x2a1a10],
  ["straight blonde hair", grooms[1], 0xd8b070],
])("16 pictures of %s have less than a quarter of the grain of one", async (_, groom, colour) => {
  const result = await server!.page.evaluate(
    async ([address, hex]) => {
      const { AverageStage: Stage, difference: apart } = window as unknown as Globals;
      const stage = await Stage.open(address, 80, hex);
      // The picture has 80 x 80 pixels. The numbers 1 and 2 choose the grain.
      const single = stage.single(1);
      const references = [stage.reference(1), stage.reference(2)];
      const averages = Array.from({ length: 16 }, () => stage.averaged()).slice(-2);
      stage.dispose();
      const reference = references[0].map((value, n) => (value + references[1][n]) / 2);
      return {
        // `error` says how much grain is left in the 16th picture.
        error: apart(averages[1], reference) / apart(single, reference),
        // `flicker` says how much the picture still changes from the 15th to the 16th.
        flicker: apart(averages[0], averages[1]) / apart(single, reference),
        // `referenceError` is the error of the reference itself: the mean of two has a quarter of the variance of their
        // difference.
        referenceError: apart(references[0], references[1]) / 4 / apart(single, reference),
      };
    },
    [`/@fs${groom}`, colour] as const,
  );
  console.log(result);
  // The reference must be much better than what it judges. The mean of 16 independent pictures has a sixteenth of the
  // grain of one, so a quarter is a wide margin.
  expect(result.referenceError).toBeLessThan(0.1);
  expect(result.error).toBeLessThan(0.25);
  expect(result.flicker).toBeLessThan(0.25);
  expect(browser.takeErrors()).toEqual([]);
});
