import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { chromium, type BrowserContext, type Page } from "playwright-core";

/** Chromium with its own profile, drawing in software: pictures are few and slow, but correct. */
export class Browser {
  readonly faults: string[] = [];
  #profile = "";
  #context: BrowserContext | null = null;

  /** `flags` are more of Chromium's. Without QUIC there is no WebTransport. */
  async start(size = { width: 960, height: 600 }, flags: readonly string[] = [], withQuic = false): Promise<void> {
    this.#profile = mkdtempSync(join(tmpdir(), "hairnet-chromium-"));
    this.#context = await chromium.launchPersistentContext(this.#profile, {
      executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
      headless: false, // the flag below is the newer kind
      viewport: size,
      args: [
        "--headless=new",
        "--no-sandbox",
        "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader",
        ...(withQuic ? [] : ["--disable-quic"]),
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        "--disable-background-timer-throttling",
        "--disable-renderer-backgrounding",
        "--disable-backgrounding-occluded-windows",
        ...flags,
      ],
    });
  }

  /** Opens a page; `faults` collects its errors. */
  async open(address: string): Promise<Page> {
    const page = await this.#context!.newPage();
    page.on("console", (message) => {
      if (message.type() === "error") this.faults.push(message.text());
    });
    page.on("pageerror", (error) => this.faults.push(String(error)));
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
    // Without any page the browser would end.
    const blank = await this.#context!.newPage();
    for (const page of this.#context!.pages()) if (page !== blank) await page.close();
  }

  /** The errors since the last call. */
  takeFaults(): string[] {
    return this.faults.splice(0);
  }

  async dispose(): Promise<void> {
    await this.#context?.close();
    rmSync(this.#profile, { recursive: true, force: true });
  }
}
