import type { Page } from "playwright-core";
import type { HairCharacter, HairScene } from "../src/scene/index";
import type { Stage } from "../page/stage";

/** The globals that pages put into `window` for tests. */
export interface PageGlobals {
  stage: Stage;
  hair: HairScene | null;
}

/** Rows of RGBA pixels, drawn at this moment. */
export interface Picture {
  width: number;
  height: number;
  pixels: number[];
}

export function readyCount(page: Page): Promise<number> {
  return page.evaluate(() => {
    const { hair } = (window as unknown as { hairnet: PageGlobals }).hairnet;
    return [...(hair?.characters.values() ?? [])].filter((one: HairCharacter) => one.isReady).length;
  });
}

/** Draws and reads a small picture at once, as screenshots take seconds in software. */
export function takePicture(page: Page, width = 320): Promise<Picture> {
  return page.evaluate((wanted) => {
    const { stage } = (window as unknown as { hairnet: PageGlobals }).hairnet;
    stage.renderer.render(stage.scene, stage.camera);
    const canvas = document.createElement("canvas");
    canvas.width = wanted;
    canvas.height = Math.round((wanted * stage.canvas.height) / stage.canvas.width);
    const context = canvas.getContext("2d", { willReadFrequently: true })!;
    context.drawImage(stage.canvas, 0, 0, canvas.width, canvas.height);
    const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
    return { width: canvas.width, height: canvas.height, pixels: Array.from(data) };
  }, width);
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

/** The share of pixels that are not the backdrop's grey: warm, as hair and skin are. */
export function shareWarm(picture: Picture): number {
  let warm = 0;
  for (let p = 0; p < picture.pixels.length; p += 4) if (picture.pixels[p] > picture.pixels[p + 2] + 12) ++warm;
  return warm / (picture.pixels.length / 4);
}
