import { existsSync, readFileSync } from "node:fs";
import { join, resolve } from "node:path";

/** The folder with the results of the C++ libraries for packets, frames, grooms and hair (`hairnet-web-vectors`). */
export const vectorFolder =
  process.env.HAIRNET_WEB_VECTORS ?? resolve(__dirname, "../../../../build/release/web-vectors");

/** One of its files. Without the file, throws with the command that makes it. */
export function vectors<T>(name: string): T {
  const path = join(vectorFolder, name);
  if (!existsSync(path)) {
    throw new Error(
      `${path} is not there: make it with build/release/bin/hairnet-web-vectors ${vectorFolder}` +
        " (HAIRNET_WEB_VECTORS names another folder)",
    );
  }
  return JSON.parse(readFileSync(path, "utf8")) as T;
}

export function fromHex(digits: string): Uint8Array {
  return new Uint8Array(Buffer.from(digits, "hex"));
}

/** Numbers from 0 up to 1, the same for the same seed (mulberry32). */
export function seeded(seed: number): () => number {
  let state = seed;
  return () => {
    state = (state + 0x6d2b79f5) | 0;
    let t = Math.imul(state ^ (state >>> 15), 1 | state);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 2 ** 32;
  };
}

/** The largest distance between numbers of two lists of the same length; Infinity where one is not finite. */
export function furthest(a: ArrayLike<number>, b: ArrayLike<number>): number {
  if (a.length !== b.length) return Infinity;
  let most = 0;
  for (let i = 0; i < a.length; ++i) {
    const apart = Math.abs(a[i] - b[i]);
    most = apart <= most ? most : apart > most ? apart : Infinity;
  }
  return most;
}
