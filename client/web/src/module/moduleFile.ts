import { HairnetError } from "../hair/hairnetError";

type Bytes = Uint8Array<ArrayBuffer>;

let read: () => Bytes | Promise<Bytes> = readFile;
let compiled: Promise<WebAssembly.Module> | null = null;

/** Says where the bytes of the C++ client come from, if not from the file beside this package's. Call it before all else. */
export function setModule(reader: () => Bytes | Promise<Bytes>): void {
  read = reader;
}

/** The C++ client, compiled once for all threads. Rejects with a one-line `HairnetError`; then it may be tried again. */
export function hairModule(): Promise<WebAssembly.Module> {
  compiled ??= compile().catch((error: unknown) => {
    compiled = null;
    throw error;
  });
  return compiled;
}

async function compile(): Promise<WebAssembly.Module> {
  if (typeof WebAssembly === "undefined") throw new HairnetError("unsupported", "this host has no WebAssembly");
  const bytes = await read();
  try {
    return await WebAssembly.compile(bytes);
  } catch (error) {
    // A strict policy forbids it.
    throw new HairnetError(
      "unsupported",
      `WebAssembly is not allowed here; a page's policy needs script-src 'wasm-unsafe-eval' (${String(error)})`,
    );
  }
}

/** Of the file beside this package's. */
async function readFile(): Promise<Bytes> {
  const url = new URL("./hairnet.wasm", import.meta.url);
  try {
    const bytes = url.protocol === "file:" ? await readLocal(url) : await download(url);
    // A web server may answer with a page of its own.
    if (String(bytes.subarray(0, 4)) !== "0,97,115,109") throw new Error("this is no WebAssembly");
    return bytes;
  } catch (error) {
    const why = error instanceof Error ? error.message : String(error);
    const cure = `with vite's server optimizeDeps: { exclude: ["hairnet-client"] }; or import "hairnet-client/inline"`;
    throw new HairnetError("unreachable", `${url.href}: ${why}; hairnet.wasm belongs there (${cure})`);
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
