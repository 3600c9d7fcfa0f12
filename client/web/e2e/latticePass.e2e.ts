import { afterAll, beforeAll, expect, test } from "vitest";
import { Browser } from "./browser";
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

const inPage = () => server!.page.evaluateHandle(() => window as unknown as typeof import("./latticePage"));

test.each(["gpu", "processor"] as const)("nodes of several bases by the %s are those of the basis", async (sum) => {
  const { apartM, movedM, newCounts, error } = await (await inPage()).evaluate(
    (page, by) => page.compareNodes(by),
    sum,
  );
  console.log(`nodes within ${Math.max(...apartM).toExponential(1)} m, of up to ${movedM.toFixed(2)} m`);
  expect(error).toBe(0);
  expect(apartM).toHaveLength(17);
  expect(newCounts).toEqual([6, 1, 5]); // nodes without a basis are always uploaded
  expect(movedM).toBeGreaterThan(0.3);
  expect(Math.max(...apartM)).toBeLessThan(1e-5);
});

test("software that plays a GPU leaves the sum to the page's thread", async () => {
  const { name, sum } = await (await inPage()).evaluate((page) => page.chosenSum());
  expect(name).toContain("SwiftShader"); // of Browser
  expect(sum).toBe("processor");
});
