import { spawn, type ChildProcess } from "node:child_process";
import { existsSync, mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { inject } from "vitest";
import { program } from "./programs";
import { until } from "./until";

/** A hairnet-server on this machine's loopback, in a process of its own. Call `dispose` at the end of a test. */
export class Server {
  /** 0 until the first `start`: the server then chooses a free port. */
  port = 0;
  #process: ChildProcess | null = null;
  /** The server's files; `dispose` removes the folder. */
  protected readonly folder = mkdtempSync(join(tmpdir(), "hairnet-web-"));

  /** `flags`: further arguments of hairnet-server. */
  constructor(private readonly flags: readonly string[] = []) {}

  get address(): string {
    return `http://127.0.0.1:${this.port}`;
  }

  /** Starts the program: on a free port the first time, and on the same port afterwards. Waits until it listens. */
  async start(): Promise<void> {
    const portFile = join(this.folder, "port");
    rmSync(portFile, { force: true });
    // Learning hair would take processor time from the tests. Levels are built once for all servers (levelCache.ts).
    const own = ["--workers", "1", "--level-cache", inject("levelCache"), "--learn-hair", "never"];
    const flags = ["--port", String(this.port), "--port-file", portFile, ...own, ...this.flags];
    this.#process = spawn(program("hairnet-server"), flags, { stdio: ["ignore", "ignore", "inherit"] });
    await until(
      "the server writes its port",
      () => existsSync(portFile) && readFileSync(portFile, "utf8").trim() !== "",
    );
    this.port = Number(readFileSync(portFile, "utf8"));
  }

  /** Stops the process: its connections stay open, and nothing comes over them until `resume`. */
  pause(): void {
    this.#process?.kill("SIGSTOP");
  }
  resume(): void {
    this.#process?.kill("SIGCONT");
  }

  /** Ends the process at once, like a crash: no client hears a goodbye. */
  async kill(): Promise<void> {
    await this.#end("SIGKILL");
  }

  /** Asks the process to end, as an operator does, and waits until it has ended. */
  async stop(): Promise<void> {
    await this.#end("SIGTERM");
  }

  async #end(signal: NodeJS.Signals): Promise<void> {
    const server = this.#process;
    this.#process = null;
    if (!server || server.exitCode !== null || server.signalCode !== null) return;
    const gone = new Promise((done) => server.once("exit", done));
    server.kill(signal);
    await gone;
  }

  async dispose(): Promise<void> {
    await this.kill();
    rmSync(this.folder, { recursive: true, force: true });
  }
}
