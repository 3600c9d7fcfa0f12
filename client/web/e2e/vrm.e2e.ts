import { mkdirSync } from "node:fs";
import { afterAll, beforeAll, expect, test } from "vitest";
import type { VrmViewer } from "../page/vrmViewer";
import { Actor, makeGroomFile } from "./actor";
import { Browser } from "./browser";
import { HairnetServer, until } from "./hairnetServer";

const server = new HairnetServer();
const browser = new Browser();
const groom = makeGroomFile("wavy");
const shots = process.env.HAIRNET_SHOTS ?? "e2e/shots";
let lender: Actor | null = null;

beforeAll(async () => {
  mkdirSync(shots, { recursive: true });
  await server.start();
  await browser.start();
});
afterAll(async () => {
  lender?.leave();
  await browser.dispose();
  await server.dispose();
});

test("a VRM model has the room's hair on its head instead of its own", async () => {
  lender = await Actor.join(server.address, "model", groom.bytes);
  const page = await browser.open(`${server.address}/vrm.html?room=model`);
  const look = () =>
    page.evaluate(() => {
      const { hair, worn, model } = (window as unknown as { hairnet: VrmViewer }).hairnet;
      const own = [...(hair?.characters.values() ?? [])].find((one) => one.own);
      const head = model?.humanoid.getRawBoneNode("head");
      const anchor = worn?.skeleton.anchor;
      return {
        isReady: own?.isReady === true,
        isAnchored: own !== undefined && own.anchor === anchor && anchor?.parent === head,
        ownHair: worn?.hiddenMeshes.map((mesh) => [mesh.name, mesh.visible]),
        bust: own?.bodyVisible,
        size: worn?.size ?? 0,
        drawCalls: hair?.statistics.drawCalls ?? 0,
        headY: own?.position.y ?? 0,
      };
    });
  await until("the model wears hair", async () => (await look()).isReady, 90_000);
  const seen = await look();
  expect(seen.isAnchored).toBe(true);
  expect(seen.ownHair).toEqual([["Hair", false]]);
  expect(seen.bust).toBe(false);
  expect(seen.size).toBeGreaterThan(0.8);
  expect(seen.size).toBeLessThan(1.4);
  expect(seen.drawCalls).toBeGreaterThan(0);
  expect(seen.headY).toBeGreaterThan(1.4);
  await new Promise((done) => setTimeout(done, 6000));
  await page.screenshot({ path: `${shots}/vrm.png`, timeout: 90_000 });
  expect(browser.takeFaults()).toEqual([]);
});
