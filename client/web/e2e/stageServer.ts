// Serves TypeScript modules to a page, for tests of what only a browser shows, without a Hairnet server.
import { mkdtempSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { Page } from "playwright-core";
import { createServer, type ViteDevServer } from "vite";
import { wasmFile } from "../scripts/wasmFile";
import type { Browser } from "./browser";

export class StageServer {
  private constructor(
    private readonly server: ViteDevServer,
    readonly page: Page,
  ) {}

  /** Opens a page that runs `e2e/NAME.ts`. `folders`: others that it reads files of, as `/@fs` and a path. */
  static async open(browser: Browser, name: string, folders: readonly string[] = []): Promise<StageServer> {
    const server = await createServer({
      configFile: false,
      plugins: [wasmFile()],
      logLevel: "warn",
      cacheDir: mkdtempSync(join(tmpdir(), "hairnet-vite-")),
      server: { host: "127.0.0.1", port: 0, hmr: false, fs: { allow: [".", "../shaders", ...folders] } },
      // Vite looks for packages in this file before the page opens. A package that Vite finds later makes it load the
      // page again.
      optimizeDeps: { entries: [`e2e/${name}.ts`] },
    });
    await server.listen();
    const page = await browser.open(`${server.resolvedUrls!.local[0]}e2e/stage.html#${name}`);
    await page.waitForFunction(() => "isReady" in window, null, { timeout: 100_000 });
    return new StageServer(server, page);
  }

  async dispose(): Promise<void> {
    await this.server.close();
  }
}
