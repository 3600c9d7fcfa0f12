import { execFileSync } from "node:child_process";
import { cpSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createServer, type Server } from "node:http";
import type { AddressInfo } from "node:net";
import { tmpdir } from "node:os";
import { extname, join } from "node:path";
import { makeGroomFile } from "./actor";
import { kPage, program } from "./hairnetServer";

const kTypes: Readonly<Record<string, string>> = {
  ".css": "text/css",
  ".html": "text/html",
  ".js": "text/javascript",
  ".json": "application/json",
  ".wasm": "application/wasm",
};

/**
 * The page as `deploy/web --static FOLDER` writes it, with one small hairstyle, behind a web server that knows files
 * alone.
 */
export class FileServer {
  readonly #folder = mkdtempSync(join(tmpdir(), "hairnet-static-"));
  #server: Server | null = null;

  async start(): Promise<void> {
    cpSync(kPage, this.#folder, { recursive: true });
    const page = join(this.#folder, "index.html");
    // The page's head names no server, so the page simulates the hair itself (`pageServer` of page/query.ts).
    const named = `<head><meta name="hairnet-server" content="none" />`;
    writeFileSync(page, readFileSync(page, "utf8").replace("<head>", named));
    cpSync(makeGroomFile("bob").path, join(this.#folder, "grooms/bob.groom"));
    // With a file of levels beside the hairstyle the hair moves at once, without a build in the page.
    execFileSync(program("hairnet-groom"), ["levels", join(this.#folder, "grooms/bob.groom")]);
    writeFileSync(join(this.#folder, "grooms/index.json"), `["bob.groom"]`);
    this.#server = createServer(({ url }, response) => {
      const { pathname } = new URL(url!, "http://localhost");
      const path = pathname === "/" ? "/index.html" : pathname;
      try {
        const bytes = readFileSync(join(this.#folder, path));
        response.writeHead(200, { "content-type": kTypes[extname(path)] ?? "application/octet-stream" }).end(bytes);
      } catch {
        response.writeHead(404).end();
      }
    });
    await new Promise<void>((done) => this.#server!.listen(0, "127.0.0.1", done));
  }

  get address(): string {
    return `http://127.0.0.1:${(this.#server!.address() as AddressInfo).port}`;
  }

  async dispose(): Promise<void> {
    this.#server?.closeAllConnections();
    await new Promise((done) => this.#server?.close(done) ?? done(null));
    rmSync(this.#folder, { recursive: true });
  }
}
