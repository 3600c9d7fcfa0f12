import { type ChildProcess, spawn } from "node:child_process";
import { once } from "node:events";
import puppeteer, { type Browser, type Page } from "puppeteer-core";

/** Debian's Firefox, on a display of its own: without one it has no WebGL. */
export class Firefox {
  #display: ChildProcess | null = null;
  #browser: Browser | null = null;

  async start(): Promise<void> {
    this.#display = spawn("/usr/bin/Xvfb", ["-displayfd", "1", "-screen", "0", "640x480x24", "-nolisten", "tcp"], {
      stdio: ["ignore", "pipe", "ignore"],
    });
    // With -displayfd 1 Xvfb chooses a free display and writes its number to its output.
    const [number] = (await once(this.#display.stdout!, "data")) as [Buffer];
    this.#browser = await puppeteer.launch({
      browser: "firefox",
      executablePath: process.env.FIREFOX ?? "/usr/bin/firefox-esr",
      // Firefox without a window has no WebGL, so it gets the display above.
      headless: false,
      defaultViewport: { width: 480, height: 320 },
      env: { ...process.env, DISPLAY: `:${number.toString().trim()}`, LIBGL_ALWAYS_SOFTWARE: "1" },
      extraPrefsFirefox: { "webgl.force-enabled": true },
    });
  }

  async open(address: string): Promise<Page> {
    const page = await this.#browser!.newPage();
    await page.goto(address, { waitUntil: "load", timeout: 120_000 });
    return page;
  }

  async dispose(): Promise<void> {
    await this.#browser?.close();
    this.#display?.kill();
  }
}
