import { afterAll, beforeAll, expect, test } from "vitest";
import { kLatticeRow } from "../src/generated/constants";
import { NodeSum } from "../src/scene/nodeSum";
import { Server } from "../test/support/server";
import { Actor, makeGroomFile } from "./actor";
import { Browser } from "./browser";
import { StageServer } from "./stageServer";

const kHeads = 3;

const browser = new Browser();
const hairnet = new Server(["--webtransport", "off"]);
const actors: Actor[] = [];
let server: StageServer | undefined;
let turning: ReturnType<typeof setInterval> | undefined;
beforeAll(async () => {
  await browser.start();
  await hairnet.start();
  server = await StageServer.open(browser, "latticePage");
  const { bytes } = makeGroomFile("bob");
  for (let n = 0; n < kHeads; ++n) actors.push(await Actor.join(hairnet.address, "nodes", bytes, [n, 0, 0]));
  turning = setInterval(() => {
    // The heads turn by 0.8 rad to both sides, once in 0.94 s.
    for (const actor of actors) actor.yawRad = 0.8 * Math.sin(performance.now() / 150);
  }, 10);
});
afterAll(async () => {
  clearInterval(turning);
  for (const actor of actors) actor.leave();
  await browser.dispose();
  await server?.dispose();
  await hairnet.dispose();
});

const inPage = () => server!.page.evaluateHandle(() => window as unknown as typeof import("./latticePage"));

test.each([
  ["GPU", NodeSum.gpu],
  ["processor", NodeSum.processor],
] as const)("nodes of a room's hair by the %s are those of its modes, and of sleeping hair stay", async (_, sum) => {
  const compare = [hairnet.address, "nodes", kHeads, sum] as const;
  const { apartM, movedM, newCounts, basisBytes, error } = await (await inPage()).evaluate(
    (page, args) => page.compareNodes(...args),
    compare,
  );
  console.log(`nodes within ${apartM.toExponential(1)} m, of up to ${movedM.toFixed(2)} m`);
  expect(error).toBe(0);
  // In the second picture the nodes of modes are there already. The page's own nodes have no basis, so they are always
  // uploaded. The third picture lacks them, and its characters have other rows.
  expect(newCounts).toEqual([kHeads + 1, 1, kHeads]);
  // Nodes move by centimetres, and both sums of floats agree within 10 um.
  expect(movedM).toBeGreaterThan(0.02);
  expect(apartM).toBeLessThan(1e-5);
  // A basis fills whole rows of kLatticeRow texels, of 16 bytes each. The processor needs none on the GPU.
  if (sum === NodeSum.gpu) expect(basisBytes % (16 * kLatticeRow)).toBe(0);
  expect(basisBytes > 0).toBe(sum === NodeSum.gpu);
});

test("software that plays a GPU leaves the sum to the page's thread", async () => {
  const { name, sum } = await (await inPage()).evaluate((page) => page.chosenSum());
  // The renderer is Mesa's software (testRun.ts).
  expect(name).toContain("llvmpipe");
  expect(sum).toBe(NodeSum.processor);
});
