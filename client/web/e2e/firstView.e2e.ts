import { mkdirSync, readFileSync } from "node:fs";
import { createRequire } from "node:module";
import type { Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, expect, test } from "vitest";
import { kHeadMiddleM } from "../page/head/headPose";
import type { PageViewer } from "../page/viewer";
import { Actor, makeGroomFile } from "./actor";
import { Browser } from "./browser";
import { HairnetServer, until } from "./hairnetServer";
import { readyCount } from "./picture";

const server = new HairnetServer();
const browser = new Browser();
const long = makeGroomFile("long_straight");
const bob = makeGroomFile("bob");
const shots = process.env.HAIRNET_SHOTS ?? "e2e/shots";
const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const actors: Actor[] = [];

type Globals = { hairnet: PageViewer };

const join = async (room: string, file: Uint8Array, x: number) => {
  actors.push(await Actor.join(server.address, room, file, [x, 1.6, 0]));
};
const shoot = (page: Page, name: string) => page.screenshot({ path: `${shots}/${name}.png`, timeout: 90_000 });

/** Where the shown person is in the picture, in pixels of the window, measured on the hair as it lies at rest. */
const seen = (page: Page) =>
  page.evaluate(() => {
    const { focus, hair, room, stage } = (window as unknown as Globals).hairnet;
    const character = hair?.characters.get(focus.person ?? -1);
    // `points` copies from the module's memory, so it is read once.
    const points = room?.members.get(focus.person ?? -1)?.groom?.points;
    if (!character?.isReady || !points) return null;
    let [bottom, top] = [Infinity, -Infinity];
    for (let i = 1; i < points.length; i += 3) {
      bottom = Math.min(bottom, points[i]);
      top = Math.max(top, points[i]);
    }
    const at = (y: number) => {
      const point = character.position.clone();
      point.y += y;
      point.project(stage.camera);
      return { x: ((point.x + 1) / 2) * innerWidth, y: ((1 - point.y) / 2) * innerHeight };
    };
    const panel = document.querySelector("#panel")!.getBoundingClientRect();
    const isSheet = panel.width > 0.9 * innerWidth;
    return {
      person: focus.person,
      // A bob ends above the chin, so at least the head down to 0.1 m below its joint counts.
      height: (at(Math.min(bottom, -0.1)).y - at(top).y) / innerHeight,
      top: at(top).y,
      middle: at((top + bottom) / 2),
      x: at(0).x,
      free: { right: isSheet ? innerWidth : panel.left, bottom: isSheet ? panel.top : innerHeight },
      isStill: !stage.motion.isFlying,
    };
  });

const person = (page: Page) => page.evaluate(() => (window as unknown as Globals).hairnet.focus.person);

/** Waits until a person is shown at rest, in the free part of the view. */
async function portrait(page: Page) {
  let found = await seen(page);
  await until("a portrait", async () => {
    found = await seen(page);
    return found?.isStill === true;
  });
  return found!;
}

/**
 * The serious findings of axe, a checker of accessibility, in the page as it is now: rule and elements, one line each.
 */
async function serious(page: Page) {
  await page.evaluate(axe);
  return page.evaluate(async () => {
    const { violations } = await (
      window as unknown as {
        axe: { run(): Promise<{ violations: { id: string; impact: string; nodes: { html: string }[] }[] }> };
      }
    ).axe.run();
    return violations
      .filter(({ impact }) => impact === "serious" || impact === "critical")
      .map(({ id, nodes }) => `${id}: ${nodes.map(({ html }) => html).join(" ")}`);
  });
}

beforeAll(async () => {
  mkdirSync(shots, { recursive: true });
  await server.start();
  await browser.start({ width: 1280, height: 720 });
  await join("front", long.bytes, 0);
  await join("front", bob.bytes, 0.6);
});
afterEach(() => browser.closePages());
afterAll(async () => {
  for (const actor of actors) actor.leave();
  await browser.dispose();
  await server.dispose();
});

test("one head fills the free part of a desktop and of a phone; a click and keys choose whom to see", async () => {
  const page = await browser.open(`${server.address}/?room=front`);
  await until("both are ready", async () => (await readyCount(page)) === 2, 90_000);
  await page.selectOption("#quality", "0.3");
  const desktop = await portrait(page);
  // A portrait fills at least 40 % of the window's height: the first look at the page must show hair, not a room.
  expect(desktop.height).toBeGreaterThanOrEqual(0.4);
  expect(desktop.top).toBeGreaterThan(0);
  // The head is in the middle of what the panel leaves free.
  expect(Math.abs(desktop.x - desktop.free.right / 2)).toBeLessThan(0.1 * desktop.free.right);
  expect(await page.isVisible("#loading")).toBe(false);
  await shoot(page, "first_view");

  // The mouse: a click on the other person flies there, a double click beside people goes back to everyone.
  const other = await page.evaluate(async () => {
    const { focus, hair } = (window as unknown as Globals).hairnet;
    const one = [...hair!.characters.values()].find(({ member }) => member !== focus.person)!;
    focus.showAll();
    // The flight begins with the next picture, so two pictures later it is under way.
    for (let picture = 0; picture < 2; ++picture) await new Promise(requestAnimationFrame);
    return { member: one.member };
  });
  await until("everyone is shown", async () => (await person(page)) === null);
  const place = { x: Infinity, y: 0 };
  await until("the other is in the free part of the view", async () => {
    const at = await page.evaluate(
      ({ member, middleM }) => {
        const { hair, stage } = (window as unknown as Globals).hairnet;
        const head = hair!.characters.get(member)!.position.clone();
        head.y += middleM;
        head.project(stage.camera);
        const isStill = !stage.motion.isFlying;
        return { x: ((head.x + 1) / 2) * innerWidth, y: ((1 - head.y) / 2) * innerHeight, isStill };
      },
      { member: other.member, middleM: kHeadMiddleM },
    );
    Object.assign(place, at);
    return at.isStill && at.x > 0 && at.x < desktop.free.right;
  });
  await page.mouse.click(place.x, place.y);
  await until("the camera shows whom the mouse chose", async () => (await person(page)) === other.member);
  await until("the other fills the view", async () => (await portrait(page)).height >= 0.4);
  // In the corner at (20, 30) there is nobody.
  await page.mouse.dblclick(20, 30);
  await until("the double click goes back", async () => (await person(page)) === null);

  // Keys: a button of the list, then Escape.
  await page.focus(`#members li[data-member="${other.member}"] button`);
  await page.keyboard.press("Enter");
  await until("the camera shows whom the list chose", async () => (await person(page)) === other.member);
  expect(await page.textContent("#shown")).toMatch(/^Showing Bob|^Showing Long/);
  await page.keyboard.press("Escape");
  await until("Escape goes back", async () => (await person(page)) === null);
  await page.focus("#view");
  await page.keyboard.press("Home");
  await until("Home shows the first view", async () => (await person(page)) !== null);
  // The minus key must enlarge the distance of the camera.
  const far = await page.evaluate(() => (window as unknown as Globals).hairnet.stage.motion.view.distance);
  await page.keyboard.press("-");
  await until("the minus key zooms out", async () => {
    return (await page.evaluate(() => (window as unknown as Globals).hairnet.stage.motion.view.distance)) > far;
  });

  // A phone: the panel is folded at first, and the head is above it.
  // The size is that of an upright phone, in CSS pixels.
  await page.setViewportSize({ width: 390, height: 844 });
  await page.reload();
  await until("both are ready again", async () => (await readyCount(page)) === 2, 90_000);
  expect(await page.isVisible("#controls")).toBe(false);
  const phone = await portrait(page);
  expect(phone.height).toBeGreaterThanOrEqual(0.4);
  expect(phone.middle.y).toBeLessThan(phone.free.bottom);
  expect(phone.top).toBeGreaterThan(0);
  await shoot(page, "first_view_phone");
  await page.click("#fold");
  await until("the sheet leaves the head free", async () => {
    const above = await portrait(page);
    // The open sheet covers the lower part of the 844 pixels, and the head moves up out of it.
    return above.free.bottom < 600 && above.middle.y < above.free.bottom - 40 && above.top > 0;
  });
  await shoot(page, "first_view_sheet");
  expect(browser.takeErrors()).toEqual([]);
});

test("the loading line is there before any hair, and the slow orbit stops for reduced motion", async () => {
  const page = await browser.open("about:blank");
  await page.addInitScript(() => {
    const lines: string[] = [];
    Object.assign(window, { lines });
    (window as unknown as { drawEvery(ms: number): void }).drawEvery(0);
    // The observer starts with the document, before any script of the page.
    new MutationObserver(() => {
      const line = document.querySelector<HTMLElement>("#loading");
      if (line && !line.hidden) lines.push(line.textContent!.trim());
    }).observe(document, { attributes: true, childList: true, characterData: true, subtree: true });
  });
  await page.goto(`${server.address}/?room=front&observe`);
  await until("both are ready", async () => (await readyCount(page)) === 2, 90_000);
  const lines = await page.evaluate(() => (window as unknown as { lines: string[] }).lines);
  expect(lines[0]).toBe("Loading the page");
  expect(lines).toContain("Connecting to the room");
  expect(lines.some((line) => /^(Downloading hairstyles|Preparing hair)/.test(line))).toBe(true);
  const turns = () => page.evaluate(() => (window as unknown as Globals).hairnet.stage.motion.isOrbiting);
  await portrait(page);
  expect(await turns()).toBe(false);
  await page.emulateMedia({ reducedMotion: "no-preference" });
  await page.reload();
  await until("it orbits", turns, 90_000);
  await portrait(page);
  // A click at the left edge hits nobody. People who touch the picture want to look by themselves.
  await page.mouse.click(30, 400);
  await until("it stops for a touch", async () => !(await turns()));
  expect(browser.takeErrors()).toEqual([]);
});

test("axe finds nothing serious in any state, and the keyboard alone reaches every control", async () => {
  const page = await browser.open(`${server.address}/?room=front`);
  await until("both are ready", async () => (await readyCount(page)) === 2, 90_000);
  await page.selectOption("#quality", "0.3");
  expect(await serious(page)).toEqual([]);

  // Every control that can be seen and used gets a number. The Tab key must reach all of them.
  const controls = await page.evaluate(() => {
    const all = [...document.querySelectorAll<HTMLElement>("button, input, select, #view")];
    const shown = all.filter((one) => one.checkVisibility()).filter((one) => !one.matches(":disabled"));
    for (const [n, one] of shown.entries()) one.dataset.control = String(n);
    return shown.map((one) => `${one.id} ${one.getAttribute("name") ?? ""} ${one.textContent?.trim().slice(0, 20)}`);
  });
  const reached = new Set<number>();
  await page.evaluate(() => (document.activeElement as HTMLElement | null)?.blur());
  // Some presses lead to what is no control, such as a link: 8 more than the controls leave room for these.
  for (let n = 0; n < controls.length + 8; ++n) {
    await page.keyboard.press("Tab");
    const at = await page.evaluate(() => (document.activeElement as HTMLElement | null)?.dataset.control);
    if (at !== undefined) reached.add(Number(at));
  }
  expect(controls.filter((_, n) => !reached.has(n))).toEqual([]);

  await page.focus("#fold");
  await page.keyboard.press("Enter");
  expect(await page.isVisible("#controls")).toBe(false);
  expect(await page.getAttribute("#fold", "aria-expanded")).toBe("false");
  expect(await serious(page)).toEqual([]);
  await page.keyboard.press("Enter");
  expect(await page.isVisible("#controls")).toBe(true);

  await page.setInputFiles("#groom-file", bob.path);
  await until("the own head is there", async () => (await readyCount(page)) === 3, 90_000);
  await until("the camera shows it", () =>
    page.evaluate(() => {
      const { focus, hair } = (window as unknown as Globals).hairnet;
      return hair?.characters.get(focus.person ?? -1)?.own === true;
    }),
  );
  expect(await serious(page)).toEqual([]);
  // The keys of a slider, and its value in words.
  await page.focus('#wind input[name="speed"]');
  await page.keyboard.press("End");
  expect(await page.getAttribute('#wind input[name="speed"]', "aria-valuetext")).toBe("20.0 m/s");
  await page.click("#wind .reset");
  expect(await page.getAttribute('#wind input[name="speed"]', "aria-valuetext")).toBe("calm");

  await page.setInputFiles("#groom-file", { name: "braid.hair", mimeType: "", buffer: Buffer.from("HAIR") });
  await until("a line says what is wrong with it", async () =>
    /^braid\.hair: /.test((await page.textContent("#error")) ?? ""),
  );
  expect(await serious(page)).toEqual([]);
  await shoot(page, "panel");
  expect(browser.takeErrors()).toEqual([]);
});
