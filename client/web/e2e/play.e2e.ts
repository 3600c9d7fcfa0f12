import { mkdirSync } from "node:fs";
import { afterAll, afterEach, beforeAll, expect, test } from "vitest";
import type { Page } from "playwright-core";
import { makeGroomFile } from "./actor";
import { Browser } from "./browser";
import { HairnetServer, until } from "./hairnetServer";
import { cameraRests, readyCount, shareChanged, shareWarm, takePicture, type PageGlobals } from "./picture";

const server = new HairnetServer();
const browser = new Browser();
const groom = makeGroomFile("long_straight");
const shots = process.env.HAIRNET_SHOTS ?? "e2e/shots";
let page: Page;

const shoot = (name: string) => page.screenshot({ path: `${shots}/${name}.png`, timeout: 90_000 });
const settle = (ms: number) => new Promise((done) => setTimeout(done, ms));
const choose = (name: string) => page.getByRole("button", { name, exact: true }).click();

beforeAll(async () => {
  mkdirSync(shots, { recursive: true });
  await server.start();
  await browser.start();
});
afterEach(() => browser.closePages());
afterAll(async () => {
  await browser.dispose();
  await server.dispose();
});

/** Opens the page in a room of its own, with hair of its own, and waits until that is in the picture. */
async function enter(room: string): Promise<void> {
  page = await browser.open(`${server.address}/?room=${room}`);
  await page.setInputFiles("#groom-file", groom.path);
  await until("the own head is ready", async () => (await readyCount(page)) === 1);
  await page.selectOption("#quality", "0.3");
  await until("it is in the picture", async () => shareWarm(await takePicture(page)) > 0.03);
}

test("a hurricane blows the hair, calm lets it rest, and sliders follow the presets", async () => {
  await enter("presets");
  // In this time the camera arrives and the hair comes to rest, so that only the wind changes the picture.
  await settle(1500);
  const calm = await takePicture(page);
  await choose("Hurricane");
  await until("hair flies", async () => shareChanged(await takePicture(page), calm) > 0.02);
  await shoot("hurricane");
  await choose("Gel");
  // The slider of gel has moved: the preset Gel sets it.
  // The preset has 800 of at most 2000 per square second: the slider, from 0 to 1, is at 0.4.
  expect(Number(await page.inputValue("input[name=gelPerS2]"))).toBeGreaterThan(0.35);
  await choose("Calm");
  expect(Number(await page.inputValue("input[name=gelPerS2]"))).toBe(0);
  await until("hair hangs again", async () => shareChanged(await takePicture(page), calm) < 0.01, 30_000);
  expect(browser.takeErrors()).toEqual([]);
});

test("in first person the own face does not hide the room; a mirror shows it; Escape leads back", async () => {
  await enter("mirror");
  await cameraRests(page);
  const before = await page.evaluate(() => {
    const { stage } = (window as unknown as { hairnet: PageGlobals }).hairnet;
    return stage.camera.position.toArray();
  });
  await choose("First person");
  // Out of the own head one must see the room. A face before the camera would fill more than half the picture.
  await until("the skin is out of the picture", async () => shareWarm(await takePicture(page)) < 0.5);
  await settle(500);
  await shoot("first_person");
  // Some own hair and skin may be in the picture without the mirror, too.
  const alone = shareWarm(await takePicture(page));
  await choose("Mirror");
  await until("the mirror shows a face", async () => shareWarm(await takePicture(page)) > alone + 0.01);
  await settle(500);
  await shoot("mirror");
  await page.keyboard.press("Escape");
  await cameraRests(page);
  const after = await page.evaluate(() => {
    const { stage } = (window as unknown as { hairnet: PageGlobals }).hairnet;
    return stage.camera.position.toArray();
  });
  // The camera is back within 5 cm of where it was.
  for (const axis of [0, 1, 2]) expect(after[axis]).toBeCloseTo(before[axis], 1);
  expect(browser.takeErrors()).toEqual([]);
});

test("an invitation has a link; sensors that are missing are reported in words", async () => {
  await enter("party");
  await page.getByText("Invite a friend").click();
  expect(await page.inputValue("#play input[readonly]")).toBe(`${server.address}/?room=party`);
  await shoot("invite");
  const control = page.getByLabel("Turn your head by").last();
  await control.selectOption("moving this device");
  await until("it says that there is none", async () =>
    /no motion sensor/.test((await page.textContent("#error")) ?? ""),
  );
  expect(await control.inputValue()).toBe("dragging it");
  expect(browser.takeErrors()).toEqual([]);
});
