import type { Page } from "playwright-core";
import type { People } from "../src/index";
import type { HairCharacter, HairScene } from "../src/scene/index";
import type { Stage } from "../page/stage";

/** The red of a warm pixel is more than this above its blue, of 255. */
const kWarmMin = 12;

/** The globals that pages put into `window` for tests. */
export interface PageGlobals {
  stage: Stage;
  hair: HairScene | null;
  room: People | null;
}

/** Rows of RGBA pixels. */
export interface Picture {
  width: number;
  height: number;
  pixels: Uint8Array | Uint8ClampedArray;
}

/** How many heads the page can draw with their hair. */
export function readyCount(page: Page): Promise<number> {
  return page.evaluate(() => {
    const { hair } = (window as unknown as { hairnet: PageGlobals }).hairnet;
    return [...(hair?.characters.values() ?? [])].filter((one: HairCharacter) => one.isReady).length;
  });
}

/**
 * Waits until the camera has arrived. A flight begins in the picture after it was asked for, so two pictures pass
 * first.
 */
export async function cameraRests(page: Page): Promise<void> {
  await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
  await page.waitForFunction(
    () => !(window as unknown as { hairnet: PageGlobals }).hairnet.stage.motion.isFlying,
    null,
    { timeout: 90_000, polling: 100 },
  );
}

/** Reads the page's next picture right after it is drawn: later the canvas is empty, and screenshots take longer. */
export function takePicture(page: Page): Promise<Picture> {
  return page.evaluate(async () => {
    const { canvas, renderer } = (window as unknown as { hairnet: PageGlobals }).hairnet.stage;
    const { frame } = renderer.info.render;
    while (renderer.info.render.frame === frame) await new Promise(requestAnimationFrame);
    const { width, height } = canvas;
    const context = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true })!;
    context.drawImage(canvas, 0, 0);
    return { width, height, pixels: context.getImageData(0, 0, width, height).data };
  });
}

/** The share of all pixels that differ by more than `margin` of 255 in a colour. */
export function shareChanged(a: Picture, b: Picture, margin = 24): number {
  let changed = 0;
  for (let p = 0; p < a.pixels.length; p += 4) {
    const apart = [0, 1, 2].some((n) => Math.abs(a.pixels[p + n] - b.pixels[p + n]) > margin);
    if (apart) ++changed;
  }
  return changed / (a.pixels.length / 4);
}

/** Whether the pixel at byte `p` is warm, as hair and skin are: the grey backdrop has no such pixels. */
export function isWarm(pixels: Uint8Array | Uint8ClampedArray, p: number): boolean {
  return pixels[p] > pixels[p + 2] + kWarmMin;
}

/** The share of pixels that are warm (`isWarm`). */
export function shareWarm(picture: Picture): number {
  let warm = 0;
  for (let p = 0; p < picture.pixels.length; p += 4) if (isWarm(picture.pixels, p)) ++warm;
  return warm / (picture.pixels.length / 4);
}
