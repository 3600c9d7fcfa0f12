import { blake2b } from "@noble/hashes/blake2.js";
import { bytesToHex } from "@noble/hashes/utils.js";

/** What the user set for one model. */
export interface RememberedFit {
  /** The factor on the hair's size. */
  size: number;
  /** How far the hair is moved up, m of the model. */
  height: number;
  /** How far the hair is moved towards the face, m of the model. */
  depth: number;
  /** The indices of the model's hidden meshes; null: those that `findHairMeshes` finds. */
  hidden: number[] | null;
}

export const kFitAsFound: Readonly<RememberedFit> = { size: 1, height: 0, depth: 0, hidden: null };

const kKey = "hairnet.avatars";
/** Settings are stored for this many models: those that were changed last. */
const kFilesMax = 32;
/** An entry of the storage with more hidden meshes than this is ignored. */
const kMeshesMax = 256;

/** Remembers settings by the hash of the model's file, those of the newest files, in the browser. */
export class RememberedFits {
  constructor(private readonly storage: Pick<Storage, "getItem" | "setItem"> | null = browserStorage()) {}

  /** The key of a model: the hash of its file, in hexadecimal digits. */
  static keyOf(file: Uint8Array): string {
    return bytesToHex(blake2b(file, { dkLen: 16 }));
  }

  get(key: string): RememberedFit {
    return this.#read().find((entry) => entry.key === key)?.fit ?? { ...kFitAsFound };
  }

  put(key: string, fit: RememberedFit): void {
    this.#write([{ key, fit: { ...fit } }, ...this.#read().filter((entry) => entry.key !== key)]);
  }

  forget(key: string): void {
    this.#write(this.#read().filter((entry) => entry.key !== key));
  }

  // Other pages of the same origin may have written anything there.
  #read(): Entry[] {
    try {
      const entries: unknown = JSON.parse(this.storage?.getItem(kKey) ?? "[]");
      return Array.isArray(entries) ? entries.filter(isEntry).slice(0, kFilesMax) : [];
    } catch {
      return [];
    }
  }

  #write(entries: readonly Entry[]): void {
    try {
      this.storage?.setItem(kKey, JSON.stringify(entries.slice(0, kFilesMax)));
    } catch {
      // A full or forbidden storage: the settings last as long as the page.
    }
  }
}

interface Entry {
  readonly key: string;
  readonly fit: RememberedFit;
}

function isEntry(entry: unknown): entry is Entry {
  const { key, fit } = (entry ?? {}) as Partial<Entry>;
  if (typeof key !== "string" || typeof fit !== "object" || fit === null) return false;
  const { size, height, depth, hidden } = fit;
  // Anything beyond 10 would put the hair out of sight.
  const isNear = (x: unknown, most: number) => typeof x === "number" && Math.abs(x) <= most;
  if (!isNear(size, 10) || size <= 0 || !isNear(height, 10) || !isNear(depth, 10)) return false;
  return hidden === null || (Array.isArray(hidden) && hidden.length <= kMeshesMax && hidden.every(Number.isInteger));
}

function browserStorage(): Storage | null {
  try {
    return globalThis.localStorage ?? null;
  } catch {
    return null;
  }
}
