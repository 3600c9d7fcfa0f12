import { execFileSync } from "node:child_process";
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { program } from "./programs";
import { Server } from "./server";

const run = (...words: string[]) => execFileSync(program("hairnet-token"), words).toString().trim();

/** A server that lets in only clients with a token of its key. The key is in a file of the server's folder. */
export class GuardedServer extends Server {
  readonly #keyFile: string;

  constructor() {
    // `Server` keeps this list and reads it in `start`. The key's flag is added once the folder exists.
    const flags: string[] = [];
    super(flags);
    this.#keyFile = join(this.folder, "key");
    writeFileSync(this.#keyFile, run("key"), { mode: 0o600 });
    flags.push("--token-key-file", this.#keyFile);
  }

  /** Makes a token that lets a participant into any room. `words`: further arguments of `hairnet-token make`. */
  token(...words: string[]): string {
    return run("make", "--key-file", this.#keyFile, "--any-room", "--role", "participant", ...words);
  }
}
