import { mkdirSync } from "node:fs";
import { afterAll, afterEach, beforeAll, expect, test } from "vitest";
import type { Page } from "playwright-core";
import { kHeadMiddleM } from "../page/head/headPose";
import { LevelIndex } from "../src/index";
import { Actor, makeGroomFile } from "./actor";
import { Browser, drawEvery } from "./browser";
import { HairnetServer, until } from "./hairnetServer";
import { cameraRests, readyCount, shareChanged, shareWarm, takePicture, type PageGlobals } from "./picture";

const server = new HairnetServer();
const browser = new Browser();
const groom = makeGroomFile("long_straight");
const other = makeGroomFile("bob");
const shots = process.env.HAIRNET_SHOTS ?? "e2e/shots";
let page: Page;
const actors: Actor[] = [];

const join = async (room: string, file = groom.bytes, x = 0) => {
  const actor = await Actor.join(server.address, room, file, [x, 1.6, 0]);
  actors.push(actor);
  return actor;
};
const settle = (ms: number) => new Promise((done) => setTimeout(done, ms));
const shoot = (name: string) => page.screenshot({ path: `${shots}/${name}.png`, timeout: 90_000 });
const state = () => page.getAttribute("#state", "data-state");

beforeAll(async () => {
  mkdirSync(shots, { recursive: true });
  await server.start();
  await browser.start();
});
afterEach(async () => {
  for (const actor of actors.splice(0)) actor.leave();
  await browser.closePages();
});
afterAll(async () => {
  await browser.dispose();
  await server.dispose();
});

test("opens without errors, reports an empty room, and shows characters that join", async () => {
  page = await browser.open(`${server.address}/?room=first&observe`);
  await until("the page is connected", async () => (await state()) === "connected");
  await until("the hint is shown", () => page.isVisible("#hint"));
  await shoot("empty");
  await join("first", groom.bytes, 0);
  await join("first", other.bytes, 0.6);
  await until("both are ready", async () => (await readyCount(page)) === 2);
  await page.selectOption("#quality", "0.3");
  await until("the list names both", async () => (await page.locator("#members li").count()) === 2);
  // Two heads cover at least 6 % of the picture, and the empty room has no warm pixels (`shareWarm`).
  await until("their hair is in the picture", async () => shareWarm(await takePicture(page)) > 0.06);
  expect(await page.isVisible("#hint")).toBe(false);
  await settle(1500);
  await shoot("two");
  expect(browser.takeErrors()).toEqual([]);
});

test("hair swings on when a head has turned and stopped, then comes to rest", async () => {
  const actor = await join("swing");
  page = await browser.open(`${server.address}/?room=swing&observe`);
  await until("it is ready", async () => (await readyCount(page)) === 1);
  await page.selectOption("#quality", "0.3");
  await until("it is in the picture", async () => shareWarm(await takePicture(page)) > 0.05);
  // A click stops the slow orbit of the camera, so that only hair changes the picture.
  await page.mouse.click(30, 300);
  await drawEvery(page, 0);
  // Hair is rigid until the server has built its levels.
  const hairOf = () =>
    page.evaluate(() => {
      const [member] = (window as unknown as { hairnet: PageGlobals }).hairnet.room!.members.values();
      let farthestM = 0;
      for (const x of member.lattice?.grid ?? []) farthestM = Math.max(farthestM, Math.abs(x));
      return { level: member.level, farthestM };
    });
  await until("its hair is simulated", async () => (await hairOf()).level === LevelIndex.high);
  // The head rests for 2 s and then turns by 0.9 rad within a quarter of a second, so that the hair swings on.
  await actor.turnTo(0, 2);
  await actor.turnTo(0.9, 0.25);
  const headYaw = () =>
    page.evaluate(() => {
      const { hair } = (window as unknown as { hairnet: PageGlobals }).hairnet;
      const [one] = [...hair!.characters.values()];
      return 2 * Math.asin(one.quaternion.y);
    });
  await until("the head has turned in the page", async () => Math.abs((await headYaw()) - 0.9) < 1e-3, 10_000);
  // The head has stopped: displacements of more than 2 cm now are the swing.
  const { farthestM } = await hairOf();
  const swinging = [await takePicture(page)];
  for (let n = 0; n < 4; ++n) {
    await settle(120);
    swinging.push(await takePicture(page));
  }
  let rest = swinging[swinging.length - 1];
  let still = 1;
  // A slow machine draws few pictures a second, each of which still makes the average finer.
  await until("nothing moves any more", async () => {
    await settle(1500);
    const later = await takePicture(page);
    still = shareChanged(rest, later);
    rest = later;
    return still < 0.002;
  });
  const moved = Math.max(...swinging.map((picture) => shareChanged(picture, rest)));
  console.log(`changed while swinging ${(100 * moved).toFixed(2)} %, at rest ${(100 * still).toFixed(2)} %`);
  expect(farthestM).toBeGreaterThan(0.02);
  // Hair covers a small part of the picture, so 0.4 % of changed pixels are a visible swing.
  expect(moved).toBeGreaterThan(0.004);
  // Pictures of hair at rest differ a little too, because the average becomes finer.
  expect(still).toBeLessThan(0.25 * moved);
  expect(browser.takeErrors()).toEqual([]);
});

test("after a server restart the page shows its hair again", async () => {
  await join("restart");
  page = await browser.open(`${server.address}/?room=restart&observe`);
  await until("it is ready", async () => (await readyCount(page)) === 1);
  await server.kill();
  await until("the page says that it reconnects", async () => (await state()) === "reconnecting");
  expect(await page.textContent("#state")).toBe("reconnecting");
  await shoot("reconnecting");
  await server.start();
  await until("the page is connected again", async () => (await state()) === "connected");
  await until("its hair is back", async () => (await readyCount(page)) === 1);
  await until("it is in the picture", async () => shareWarm(await takePicture(page)) > 0.05);
  // The browser itself logs each failed attempt.
  expect(browser.takeErrors(/WebSocket connection|ERR_CONNECTION/)).toEqual([]);
});

test("two pages see each other, and a head that keys or the mouse turn is seen turning by others", async () => {
  page = await browser.open(`${server.address}/?room=pair`);
  const second = await browser.open(`${server.address}/?room=pair`);
  await page.setInputFiles("#groom-file", groom.path);
  await until("the first has its own", async () => (await readyCount(page)) === 1);
  await second.setInputFiles("#groom-file", other.path);
  for (const one of [page, second]) await until("it sees both", async () => (await readyCount(one)) === 2, 90_000);
  const places = await page.evaluate(() => {
    const { hair } = (window as unknown as { hairnet: PageGlobals }).hairnet;
    return [...hair!.characters.values()].map((one) => one.position.x);
  });
  // People who join get places beside each other: closer ones would stand in one another.
  expect(Math.abs(places[0] - places[1])).toBeGreaterThan(0.5);
  const yawOfOther = (in_: Page) =>
    in_.evaluate(() => {
      const { hair } = (window as unknown as { hairnet: PageGlobals }).hairnet;
      return [...hair!.characters.values()].filter((one) => !one.own).map((one) => 2 * Math.asin(one.quaternion.y))[0];
    });
  await second.close();
  await until("the second has left", async () => (await readyCount(page)) === 1, 90_000);
  const third = await join("pair", other.bytes, 1.2);
  await until("somebody else has come", async () => (await readyCount(page)) === 2, 90_000);
  await page.focus("#view");
  await page.keyboard.down("ArrowRight");
  const seenBy = () => {
    const [me] = [...third.room.members.values()].filter((member) => !member.own);
    return me?.pose ? 2 * Math.asin(me.pose[1]) : 0;
  };
  // `seenBy` is the angle of the page's head as the third person sees it, rad.
  await until("the other sees the head turn", () => Math.abs(seenBy()) > 0.3);
  await page.keyboard.up("ArrowRight");
  await until("and come back", () => Math.abs(seenBy()) < 0.05);
  await cameraRests(page);
  // The press is at the middle of the head.
  const at = await page.evaluate((middleM) => {
    const { hair, stage } = (window as unknown as { hairnet: PageGlobals }).hairnet;
    const own = [...hair!.characters.values()].find((one) => one.own)!;
    const { x, y } = own.position
      .clone()
      .setY(own.position.y + middleM)
      .project(stage.camera);
    return { x: ((x + 1) / 2) * innerWidth, y: ((1 - y) / 2) * innerHeight };
  }, kHeadMiddleM);
  await page.mouse.move(at.x, at.y);
  await page.mouse.down();
  await page.mouse.move(at.x - 90, at.y, { steps: 6 });
  await until("it sees the dragged head turn the other way", () => seenBy() < -0.3);
  await page.mouse.up();
  await until("and come back, too", () => Math.abs(seenBy()) < 0.05);
  expect(Math.abs(await yawOfOther(page))).toBeLessThan(0.01);
  await page.selectOption("#quality", "0.3");
  await settle(1500);
  await shoot("own_head");
  expect(browser.takeErrors()).toEqual([]);
});

test("a phone's width has no sideways scrolling and still shows the head", async () => {
  await join("phone");
  page = await browser.open(`${server.address}/?room=phone`);
  // 320 pixels are the narrowest phone that pages are usually made for.
  await page.setViewportSize({ width: 320, height: 640 });
  await until("it is ready", async () => (await readyCount(page)) === 1);
  const widest = await page.evaluate(() => {
    const edges = [...document.querySelectorAll<HTMLElement>("#panel *")]
      .filter((one) => one.offsetParent)
      .map((one) => one.getBoundingClientRect());
    return {
      scroll: Math.max(document.documentElement.scrollWidth, document.body.scrollWidth),
      right: Math.max(...edges.map((edge) => edge.right)),
      left: Math.min(...edges.map((edge) => edge.left)),
      panel: document.querySelector("#controls")!.scrollWidth - document.querySelector("#controls")!.clientWidth,
    };
  });
  expect(widest.scroll).toBeLessThanOrEqual(320);
  expect(widest.right).toBeLessThanOrEqual(320);
  expect(widest.left).toBeGreaterThanOrEqual(0);
  // The panel's content is not wider than the panel.
  expect(widest.panel).toBeLessThanOrEqual(0);
  await page.selectOption("#quality", "0.3");
  await settle(1500);
  await shoot("phone");
  await page.click("#fold");
  expect(await page.isVisible("#controls")).toBe(false);
  expect(browser.takeErrors()).toEqual([]);
});

test("hair is drawn again after the graphics context was lost", async () => {
  await join("lost");
  page = await browser.open(`${server.address}/?room=lost&observe`);
  await until("it is ready", async () => (await readyCount(page)) === 1);
  await page.selectOption("#quality", "0.3");
  await until("it is in the picture", async () => shareWarm(await takePicture(page)) > 0.05);
  await page.evaluate(async () => {
    const { stage } = (window as unknown as { hairnet: PageGlobals }).hairnet;
    const loss = stage.renderer.getContext().getExtension("WEBGL_lose_context")!;
    const lost = new Promise((done) => stage.canvas.addEventListener("webglcontextlost", done, { once: true }));
    loss.loseContext();
    await lost;
    // The page goes on for some pictures without a context, and must not fail in them.
    await new Promise((done) => setTimeout(done, 500));
    const back = new Promise((done) => stage.canvas.addEventListener("webglcontextrestored", done, { once: true }));
    loss.restoreContext();
    await back;
  });
  await until("it is in the picture again", async () => shareWarm(await takePicture(page)) > 0.05);
  // The browser logs the loss of the context, and each call with an object of the lost one, as an error.
  expect(browser.takeErrors(/context (was )?lost|CONTEXT_LOST|WebGL: INVALID_OPERATION/i)).toEqual([]);
});

test("a missing server and a browser that cannot draw are each reported in one line", async () => {
  // Nothing listens at port 9.
  page = await browser.open(`${server.address}/?server=ws://127.0.0.1:9`);
  await until("the state says so", async () => (await state()) === "closed");
  await until("a line says why", async () =>
    /^The server does not answer at 127\.0\.0\.1:9\. The page tries again in \d+ s\.$/.test(
      (await page.textContent("#error")) ?? "",
    ),
  );
  await shoot("server_gone");
  // From the next load on the browser gives no WebGL, as one on a machine that cannot draw.
  await page.addInitScript(() => {
    const get = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (this: HTMLCanvasElement, kind: string, ...rest: unknown[]) {
      return kind.startsWith("webgl") ? null : (get as (...all: unknown[]) => unknown).call(this, kind, ...rest);
    } as typeof get;
  });
  await page.reload();
  await until("a line says what lacks", async () => /no WebGL 2/.test((await page.textContent("#error")) ?? ""));
  expect((await page.textContent("#error"))!.includes("\n")).toBe(false);
  browser.takeErrors();
});
