import { chromium, type Browser as Connection, type BrowserContext, type Page } from "playwright-core";
import { inject } from "vitest";

/**
 * Pages draw at this interval. If they drew as often as they can, they would leave no time to servers and to each
 * other.
 */
const kPictureEveryMs = 200;

/**
 * What the browser itself logs while a server is gone, or UDP does not reach it: failed connections and downloads.
 */
export const kServerGone = /WebSocket connection|Failed to establish a connection|net::ERR_|status of 503/;

/**
 * Pages of the run's Chromium (testRun.ts) that share nothing with those of other test files. `smooths`: with four
 * samples a pixel, as users' browsers draw, for tests of pictures; that takes software several times as long.
 */
export class Browser {
  readonly errors: string[] = [];
  #connection: Connection | null = null;
  #context: BrowserContext | null = null;

  constructor(private readonly smooths = false) {}

  /**
   * `pixelRatio`: of drawn pixels to those of `size`: software takes long for the picture of a whole desktop. Pages
   * prefer reduced motion: a camera's flight is many pictures.
   */
  async start(size = { width: 960, height: 600 }, pixelRatio = 1 / 4): Promise<void> {
    this.#connection = await chromium.connect(inject("chromium"));
    this.#context = await this.#connection.newContext({
      viewport: size,
      deviceScaleFactor: pixelRatio,
      reducedMotion: "reduce",
    });
    await this.#context.addInitScript(drawSeldom, kPictureEveryMs);
    if (!this.smooths) await this.#context.addInitScript(drawOneSample);
  }

  /** Opens a page; `errors` collects its errors. */
  async open(address: string): Promise<Page> {
    const page = await this.#context!.newPage();
    page.on("console", (message) => {
      if (message.type() === "error") this.errors.push(message.text());
    });
    page.on("pageerror", (error) => this.errors.push(String(error)));
    await page.goto(address, { waitUntil: "load", timeout: 120_000 });
    return page;
  }

  /** Pages get this JSON from such an address, instead of what the server says; null: they get that again. */
  async answer(address: string, json: object | null): Promise<void> {
    if (json === null) await this.#context!.unroute(address);
    else await this.#context!.route(address, (route) => route.fulfill({ json }));
  }

  /** A page that continues to draw slows all others down. */
  async closePages(): Promise<void> {
    for (const page of this.#context!.pages()) await page.close();
  }

  /** The errors since the last call, without those that are expected. */
  takeErrors(expected?: RegExp): string[] {
    return this.errors.splice(0).filter((error) => !expected?.test(error));
  }

  async dispose(): Promise<void> {
    await this.#connection?.close();
  }
}

/** Pictures of the page come this seldom from now on. */
export const drawEvery = (page: Page, everyMs: number): Promise<void> =>
  page.evaluate((ms) => (window as unknown as { drawEvery(ms: number): void }).drawEvery(ms), everyMs);

/**
 * Runs in pages, before their programs: pictures come this seldom. Callbacks for one come in the order of their
 * requests.
 */
function drawSeldom(usualMs: number): void {
  let [everyMs, timer] = [usualMs, 0];
  const request = requestAnimationFrame.bind(window);
  const waiting = new Map<number, FrameRequestCallback>();
  let [count, lastMs] = [0, 0];
  const draw = (timeMs: number) => {
    lastMs = timeMs;
    const now = [...waiting.values()];
    waiting.clear();
    for (const each of now) each(timeMs);
  };
  const wait = () => {
    timer = window.setTimeout(() => request(draw), lastMs + everyMs - performance.now());
  };
  Object.assign(window, {
    drawEvery(ms: number) {
      everyMs = ms;
      clearTimeout(timer);
      if (waiting.size > 0) wait();
    },
  });
  window.requestAnimationFrame = (callback) => {
    if (waiting.size === 0) wait();
    waiting.set(++count, callback);
    return count;
  };
  window.cancelAnimationFrame = (number) => waiting.delete(number);
}

/** Runs in pages, before their programs: canvases have one sample a pixel. */
function drawOneSample(): void {
  const { getContext } = HTMLCanvasElement.prototype as { getContext: (...all: unknown[]) => unknown };
  HTMLCanvasElement.prototype.getContext = function (this: HTMLCanvasElement, kind: string, options?: object) {
    return getContext.call(this, kind, kind.startsWith("webgl") ? { ...options, antialias: false } : options);
  } as typeof HTMLCanvasElement.prototype.getContext;
}
