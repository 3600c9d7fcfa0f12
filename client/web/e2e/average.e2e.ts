import { afterAll, beforeAll, expect, test } from "vitest";
import type { Page } from "playwright-core";
import { Actor, makeGroomFile } from "./actor";
import { Browser } from "./browser";
import { HairnetServer, until } from "./hairnetServer";
import type { PageViewer } from "../page/viewer";
import { readyCount } from "./picture";

const server = new HairnetServer();
const browser = new Browser();
const groom = makeGroomFile("bob", 800);
let page: Page;
let actor: Actor;

beforeAll(async () => {
  await server.start();
  await browser.start({ width: 640, height: 400 });
  actor = await Actor.join(server.address, "still", groom.bytes, [0, 1.6, 0]);
  page = await browser.open(`${server.address}/?room=still&observe`);
  await until("the hair is ready", async () => (await readyCount(page)) === 1);
  await page.evaluate(freeze);
});
afterAll(async () => {
  actor?.leave();
  await browser.dispose();
  await server.dispose();
});

/** From here on nothing moves, and only the test draws: a small picture of the head. */
function freeze(): void {
  const { stage, hair, room } = (window as unknown as { hairnet: PageViewer }).hairnet;
  const { renderer, scene, camera, picture } = stage;
  renderer.setAnimationLoop(null);
  const side = 96;
  const view = camera.clone();
  view.clearViewOffset();
  view.aspect = 1;
  view.fov = 30;
  view.updateProjectionMatrix();
  const [character] = hair!.characters.values();
  const { position } = character;
  character.detail = { strandShare: 1, followHairCount: 0, toleranceM: 3e-4, quadratic: 1, cards: 0 };
  const aim = (bearing: number) => {
    view.position.set(position.x + 0.7 * Math.sin(bearing), position.y + 0.05, position.z + 0.7 * Math.cos(bearing));
    view.lookAt(position.x, position.y, position.z);
    view.updateMatrixWorld();
  };
  const shown = room!.sample(performance.now());
  room!.sample = () => shown;
  const read = (width: number) => {
    const gl = renderer.getContext();
    const pixels = new Uint8Array(4 * width * width);
    gl.readPixels(0, 0, width, width, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return pixels;
  };
  const size = (pixels: number) => {
    renderer.setPixelRatio(1);
    renderer.setSize(pixels, pixels, false);
  };
  /** One picture at once: its pixels. */
  const plain = () => {
    hair!.update(view);
    renderer.render(scene, view);
    return Array.from(read(side));
  };
  /** The last of `count` pictures of an average. */
  const average = (count: number) => {
    for (let n = 0; n < count; ++n) {
      hair!.update(view);
      picture.render(scene, view, hair);
    }
    return Array.from(read(side));
  };
  /** With 64 samples a pixel. */
  const reference = () => {
    size(4 * side);
    hair!.update(view);
    renderer.render(scene, view);
    const large = read(4 * side);
    size(side);
    return Array.from({ length: 4 * side * side }, (_, at) => {
      const x = (at >> 2) % side;
      const y = Math.floor((at >> 2) / side);
      let sum = 0;
      for (let n = 0; n < 16; ++n) sum += large[4 * ((4 * y + (n >> 2)) * 4 * side + 4 * x + (n & 3)) + (at & 3)];
      return sum / 16;
    });
  };
  size(side);
  aim(0.4);
  Object.assign(window, { average: { plain, average, reference, aim, cut: () => picture.cut() } });
}

interface AverageGlobals {
  plain: () => number[];
  average: (count: number) => number[];
  reference: () => number[];
  aim: (bearing: number) => void;
  cut: () => void;
}
/** Calls one of the functions of `freeze` in the page. */
const call = <K extends keyof AverageGlobals>(name: K, argument?: number) =>
  page.evaluate(
    ([asked, value]) =>
      (window as unknown as { average: Record<string, (value?: number) => unknown> }).average[asked](value),
    [name, argument] as const,
  ) as Promise<ReturnType<AverageGlobals[K]>>;

function meanSquare(a: readonly number[], b: readonly number[]): number {
  return a.reduce((sum, value, n) => sum + (value - b[n]) ** 2, 0) / a.length;
}

function meanOf(a: readonly number[]): number {
  return a.reduce((sum, value) => sum + value, 0) / a.length;
}

test("a still picture converges to one of 64 samples a pixel, with the same mean", async () => {
  const reference = await call("reference");
  await call("cut");
  const first = await call("average", 1);
  const later = await call("average", 19);
  const before = meanSquare(first, reference);
  const after = meanSquare(later, reference);
  console.log(`mean square error of the first picture ${before.toFixed(1)}, of twenty ${after.toFixed(1)} (of 255)`);
  expect(after).toBeLessThan(0.35 * before);
  expect(Math.abs(meanOf(later) - meanOf(reference))).toBeLessThan(1.5);
});

test("colours are those of a picture at once", async () => {
  await call("cut");
  expect(Math.abs(meanOf(await call("average", 4)) - meanOf(await call("plain")))).toBeLessThan(1);
});

test("two still pictures of an average differ by less than a fifth of two single ones", async () => {
  await call("cut");
  const single = await call("average", 1);
  const other = await call("average", 1);
  await call("average", 18);
  const a = await call("average", 1);
  const b = await call("average", 1);
  expect(meanSquare(single, other)).toBeGreaterThan(0);
  expect(Math.sqrt(meanSquare(a, b))).toBeLessThan(0.2 * Math.sqrt(4 * meanSquare(single, other)));
});

test("after a jump of the camera nothing of the pictures before is shown", async () => {
  await call("aim", 2.4);
  await call("cut");
  const alone = await call("average", 1);
  await call("aim", 0.4);
  await call("average", 5);
  await call("aim", 2.4); // not told
  expect(await call("average", 1)).toEqual(alone);
  expect(browser.takeFaults()).toEqual([]);
});
