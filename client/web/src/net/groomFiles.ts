import { HairnetError } from "../hair/hairnetError";
import type { GroomFetched } from "./events";
import type { GroomHash } from "./groomHash";

// Between two requests for one file: a server that sends too much already refuses.
const kAskAgainNs = 2e9;

interface Entry<Known> {
  readonly file: GroomHash;
  known: Known | null;
  isUnusable: boolean;
  askedNs: number;
}

/**
 * Files that the server makes of grooms, of one kind (bases, learnt hair), as it announced them and as they have
 * arrived.
 */
export class GroomFiles<Known extends object> {
  /** by groom */
  readonly #entries = new Map<GroomHash, Entry<Known>>();
  /** by file: a session that is lost may come back with the same files, whose hair then continues */
  readonly #used = new Map<GroomHash, WeakRef<Known>>();

  /** `decode` throws `HairnetError` for a file that cannot be used, and nothing else. */
  constructor(private readonly decode: (file: Uint8Array) => Known) {}

  /** The server announces the same file again over each connection. Another one replaces the file that is here. */
  announce(groom: GroomHash, file: GroomHash): void {
    if (this.#entries.get(groom)?.file === file) return;
    const known = this.#used.get(file)?.deref() ?? null;
    this.#entries.set(groom, { file, known, isUnusable: false, askedNs: -Infinity });
  }

  /**
   * The file to ask for, once a frame needs it; null while the file is here, cannot be used, was not announced, or was
   * asked for a moment ago.
   */
  wanted(groom: GroomHash, nowNs: number): GroomHash | null {
    const entry = this.#entries.get(groom);
    if (!entry || entry.known || entry.isUnusable || nowNs - entry.askedNs < kAskAgainNs) return null;
    entry.askedNs = nowNs;
    return entry.file;
  }

  /** The grooms whose file has this hash. */
  groomsOf(file: GroomHash): GroomHash[] {
    return [...this.#entries].filter(([, entry]) => entry.file === file).map(([groom]) => groom);
  }

  /** Takes a file, which several grooms may have. Returns why it cannot be used; empty: it can. */
  take({ hash, bytes, fault }: GroomFetched): string {
    if (!bytes) return fault;
    const entries = [...this.#entries.values()].filter((entry) => entry.file === hash);
    try {
      const known = this.decode(bytes);
      for (const entry of entries) entry.known = known;
      for (const [file, used] of this.#used) if (!used.deref()) this.#used.delete(file);
      this.#used.set(hash, new WeakRef(known));
      return "";
    } catch (error) {
      if (!(error instanceof HairnetError)) throw error;
      for (const entry of entries) entry.isUnusable = true;
      return error.message;
    }
  }

  /** Null: not here. */
  of(groom: GroomHash): Known | null {
    return this.#entries.get(groom)?.known ?? null;
  }

  /** The hash of the groom's file; null: not announced. */
  fileOf(groom: GroomHash): GroomHash | null {
    return this.#entries.get(groom)?.file ?? null;
  }

  /** The session is lost. Returns the files that were announced. */
  clear(): GroomHash[] {
    const files = [...this.#entries.values()].map((entry) => entry.file);
    this.#entries.clear();
    return files;
  }
}
