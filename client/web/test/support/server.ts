import type { ChildProcess } from "node:child_process";
import { spawn } from "node:child_process";
import { existsSync, mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { setTimeout as sleep } from "node:timers/promises";

/** The server's program: HAIRNET_SERVER, or that of the release build. */
export const serverProgram =
  process.env.HAIRNET_SERVER ?? resolve(__dirname, "../../../../build/release/bin/hairnet-server");
export const hasServer = existsSync(serverProgram);

/** A hairnet-server on this machine's loopback. */
export class Server {
  #process: ChildProcess | null = null;
  #folder = mkdtempSync(join(tmpdir(), "hairnet-web-"));
  port = 0;

  /** On a free port at first, then on the same one again. */
  async start(): Promise<void> {
    const portFile = join(this.#folder, "port");
    rmSync(portFile, { force: true });
    this.#process = spawn(serverProgram, ["--port", String(this.port), "--port-file", portFile], { stdio: "ignore" });
    await until(() => existsSync(portFile) && readFileSync(portFile, "utf8").trim() !== "", "the server to start");
    this.port = Number(readFileSync(portFile, "utf8"));
  }

  async kill(): Promise<void> {
    const server = this.#process;
    if (!server) return;
    const gone = new Promise((done) => server.once("exit", done));
    server.kill("SIGKILL");
    await gone;
    this.#process = null;
  }

  async dispose(): Promise<void> {
    await this.kill();
    rmSync(this.#folder, { recursive: true });
  }
}

/** Waits for it, a minute and a half at most. */
export async function until(isTrue: () => boolean, what: string): Promise<void> {
  for (let n = 0; n < 9000; ++n) {
    if (isTrue()) return;
    await sleep(10);
  }
  throw new Error(`waited in vain for ${what}`);
}
