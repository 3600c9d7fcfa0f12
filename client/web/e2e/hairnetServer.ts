import { spawn, type ChildProcess } from "node:child_process";
import { existsSync, mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";

/** The folder of hairnet-server, hairnet-view and hairnet-groom: HAIRNET_BIN, by default that of the release build. */
export const kBin = resolve(process.env.HAIRNET_BIN ?? "../../build/release/bin");
export const kPage = resolve("dist-page");

export function program(name: string): string {
  const path = join(kBin, name);
  if (!existsSync(path)) throw new Error(`${path} is missing: build it (ninja ${name}), or set HAIRNET_BIN`);
  return path;
}

/** A server of its own, on a port of its own, that hands out the built page. */
export class HairnetServer {
  port = 0;
  #process: ChildProcess | null = null;
  readonly #folder = mkdtempSync(join(tmpdir(), "hairnet-e2e-"));

  get address(): string {
    return `http://127.0.0.1:${this.port}`;
  }

  /** On a free port the first time, on the same again afterwards. */
  async start(): Promise<void> {
    const portFile = join(this.#folder, "port");
    rmSync(portFile, { force: true });
    const flags = ["--port", String(this.port), "--port-file", portFile, "--web-root", kPage, "--workers", "1"];
    this.#process = spawn(program("hairnet-server"), flags, { stdio: ["ignore", "ignore", "inherit"] });
    await until("the server writes its port", () => existsSync(portFile) && readFileSync(portFile, "utf8").trim() !== "");
    this.port = Number(readFileSync(portFile, "utf8"));
  }

  /** At once, as a crash would. */
  async kill(): Promise<void> {
    await end(this.#process, "SIGKILL");
    this.#process = null;
  }

  async dispose(): Promise<void> {
    await this.kill();
    rmSync(this.#folder, { recursive: true, force: true });
  }
}

async function end(child: ChildProcess | null, signal: NodeJS.Signals): Promise<void> {
  if (!child || child.exitCode !== null || child.signalCode !== null) return;
  const ended = new Promise((done) => child.once("exit", done));
  child.kill(signal);
  await ended;
}

/** Looks every now and then until it is so; fails with what was waited for. */
export async function until(what: string, isSo: () => boolean | Promise<boolean>, timeoutMs = 90_000): Promise<void> {
  const endMs = Date.now() + timeoutMs;
  while (!(await isSo())) {
    if (Date.now() > endMs) throw new Error(`it did not come about that ${what}`);
    await new Promise((done) => setTimeout(done, 100));
  }
}
