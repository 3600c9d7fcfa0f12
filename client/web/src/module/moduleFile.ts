import { HairnetError, messageOf } from "./hairnetError";

type Bytes = Uint8Array<ArrayBuffer>;

/** A .wasm file of the C++ client, compiled once for all threads. */
export class ModuleFile {
  #compiled: Promise<WebAssembly.Module> | null = null;

  constructor(private readonly read: () => Bytes | Promise<Bytes>) {}

  /** Somebody has asked for the module. */
  get isWanted(): boolean {
    return this.#compiled !== null;
  }

  /** Reads and compiles the file, once. After a failure, a one-line `HairnetError`, the next call tries again. */
  compiled(): Promise<WebAssembly.Module> {
    this.#compiled ??= this.#compile().catch((error: unknown) => {
      this.#compiled = null;
      throw error;
    });
    return this.#compiled;
  }

  async #compile(): Promise<WebAssembly.Module> {
    if (typeof WebAssembly === "undefined") throw new HairnetError("unsupported", "this host has no WebAssembly");
    const bytes = await this.read();
    try {
      return await WebAssembly.compile(bytes);
    } catch (error) {
      // The page's Content-Security-Policy may forbid WebAssembly.
      throw new HairnetError(
        "unsupported",
        `WebAssembly is not allowed here; a page's policy needs script-src 'wasm-unsafe-eval' (${String(error)})`,
      );
    }
  }
}

let file = new ModuleFile(() =>
  readFile(new URL("./hairnet.wasm", import.meta.url), 'or import "hairnet-client/inline"'),
);

/**
 * Says where the C++ client comes from, if not from hairnet.wasm beside this package's files. Later it has no effect.
 */
export function setModule(another: ModuleFile): void {
  if (!file.isWanted) file = another;
}

/** The C++ client of this page. */
export function hairModule(): Promise<WebAssembly.Module> {
  return file.compiled();
}

/** The bytes of a file beside the package's; `cure`: what else may help where it is not there. */
export async function readFile(url: URL, cure: string): Promise<Bytes> {
  try {
    const bytes = url.protocol === "file:" ? await readLocal(url) : await download(url);
    // A web server may answer with a page of its own. The first four bytes of WebAssembly are 0, "a", "s", "m".
    if (String(bytes.subarray(0, 4)) !== "0,97,115,109") throw new Error("this is no WebAssembly");
    return bytes;
  } catch (thrown) {
    const error = messageOf(thrown);
    const name = url.pathname.slice(url.pathname.lastIndexOf("/") + 1);
    const cures = `with vite's server optimizeDeps: { exclude: ["hairnet-client"] }; ${cure}`;
    throw new HairnetError("unreachable", `${url.href}: ${error}; ${name} belongs there (${cures})`);
  }
}

async function readLocal(url: URL): Promise<Bytes> {
  const files = "node:fs/promises";
  return new Uint8Array(await (await import(/* @vite-ignore */ files)).readFile(url));
}

async function download(url: URL): Promise<Bytes> {
  const response = await fetch(url);
  if (!response.ok) throw new Error(`status ${response.status}`);
  return new Uint8Array(await response.arrayBuffer());
}
