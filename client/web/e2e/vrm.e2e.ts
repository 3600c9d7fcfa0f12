import { mkdirSync } from "node:fs";
import { afterAll, beforeAll, expect, test } from "vitest";
import { makeAvatar } from "../scripts/avatar/madeAvatar";
import type { PageViewer } from "../page/viewer";
import { makeGroomFile } from "./actor";
import { Browser } from "./browser";
import { dropFiles } from "./dropFiles";
import { HairnetServer, until } from "./hairnetServer";

const server = new HairnetServer();
const browser = new Browser();
const groom = makeGroomFile("wavy");
const shots = process.env.HAIRNET_SHOTS ?? "e2e/shots";

beforeAll(async () => {
  mkdirSync(shots, { recursive: true });
  await server.start();
  await browser.start();
});
afterAll(async () => {
  await browser.dispose();
  await server.dispose();
});

test("the user has a VRM model with the hair of the room on its head instead of its own", async () => {
  const page = await browser.open(`${server.address}/?room=model`);
  const drop = (name: string, bytes: Uint8Array) => dropFiles(page, [name, bytes]);
  const look = () =>
    page.evaluate(() => {
      const { hair, avatar } = (window as unknown as { hairnet: PageViewer }).hairnet;
      const own = [...(hair?.characters.values() ?? [])].find((one) => one.own);
      const { vrm, vrmHair } = avatar.avatar ?? {};
      const anchor = vrmHair?.skeleton.anchor;
      return {
        isReady: own?.isReady === true && own.anchor !== null && own.anchor === anchor,
        version: vrm?.meta.metaVersion ?? "",
        isOnHead: anchor !== undefined && anchor.parent === vrm?.humanoid.getRawBoneNode("head"),
        hidden: vrmHair?.hiddenMeshes.map((mesh) => [mesh.name, mesh.visible]),
        bust: own?.bodyVisible,
        size: vrmHair?.size ?? 0,
        drawCalls: hair?.statistics.drawCalls ?? 0,
      };
    });
  const hasHair = (version: string) => async () => {
    const now = await look();
    return now.version === version && now.isReady && now.drawCalls > 0;
  };
  const error = () => page.evaluate(() => document.querySelector<HTMLElement>("#error")?.textContent ?? "");

  await drop("LICENSE.vrm", new TextEncoder().encode("MIT License"));
  await until("the page tells that it is no model", async () => (await error()).includes("not a VRM file"), 60_000);

  // Nobody else is in the room, and the server lists no hairstyle, so the model waits for one.
  await drop("person.vrm", makeAvatar({ version: 0, hairMesh: "Hair" }));
  await page.setInputFiles("#groom-file", groom.path);
  await until("the dropped model has hair", hasHair("0"), 90_000);
  const seen = await look();
  expect(seen.version).toBe("0");
  expect(seen.isOnHead).toBe(true);
  // The model's own hair is hidden, and so is the groom's bust.
  expect(seen.hidden).toEqual([["Hair", false]]);
  expect(seen.bust).toBe(false);
  // The model's head is about as large as the groom's.
  expect(seen.size).toBeGreaterThan(0.8);
  expect(seen.size).toBeLessThan(1.4);

  // What the user sets for a model is remembered and used when the same file is dropped again.
  await page.evaluate(() => {
    const size = document.querySelector<HTMLInputElement>('#avatar input[name="size"]')!;
    size.value = "1.2";
    size.dispatchEvent(new Event("input"));
  });
  expect((await look()).size).toBeCloseTo(1.2 * seen.size, 3);
  // A second model, without hair of its own, has the fit that was measured. The first one must get its own fit back.
  await drop("another.vrm", makeAvatar({ version: 1 }));
  await until("another model has hair", hasHair("1"), 90_000);
  await drop("person.vrm", makeAvatar({ version: 0, hairMesh: "Hair" }));
  await until("the first model is back", hasHair("0"), 90_000);
  expect((await look()).size).toBeCloseTo(1.2 * seen.size, 3);
  await page.click("#avatar >> text=Reset the fit");
  expect((await look()).size).toBeCloseTo(seen.size, 3);
  await page.screenshot({ path: `${shots}/vrm.png`, timeout: 90_000 });

  await page.click("#avatar >> text=Take off");
  await until("the bust is back", async () => (await look()).bust === true, 60_000);
  expect(browser.takeErrors()).toEqual([]);
});
