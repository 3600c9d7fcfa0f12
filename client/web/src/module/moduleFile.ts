import { HairnetError } from "../hair/hairnetError";

/** Beside the module of this package that imports it. */
const kUrl = new URL("./hairnet.wasm", import.meta.url);

let compiled: Promise<WebAssembly.Module> | null = null;

/** The C++ client, compiled once for all threads. Rejects with a one-line `HairnetError`. */
export function hairModule(): Promise<WebAssembly.Module> {
  compiled ??= compile();
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

async function read(): Promise<BufferSource> {
  if (kUrl.protocol === "file:") {
    const files = "node:fs/promises";
    return (await import(/* @vite-ignore */ files)).readFile(kUrl);
  }
  const response = await fetch(kUrl).catch((error: unknown) => ({ ok: false as const, status: String(error) }));
  if (!response.ok)
    throw new HairnetError("unreachable", `${kUrl.href}: ${response.status}; hairnet.wasm belongs beside the package`);
  return response.arrayBuffer();
}
