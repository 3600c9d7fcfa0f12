import { execFileSync } from "node:child_process";
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { program } from "./programs";
import { Server } from "./server";

const run = (...words: string[]) => execFileSync(program("hairnet-token"), words).toString().trim();

/** A server that wants tokens. */
export class GuardedServer extends Server {
  readonly #keyFile: string;

  constructor() {
    const flags: string[] = [];
    super(flags);
    this.#keyFile = join(this.folder, "key");
    writeFileSync(this.#keyFile, run("key"), { mode: 0o600 });
    flags.push("--token-key-file", this.#keyFile);
  }

  /** Lets a participant into any of its rooms; `words`: more of `hairnet-token make`. */
  token(...words: string[]): string {
    return run("make", "--key-file", this.#keyFile, "--any-room", "--role", "participant", ...words);
  }
}
