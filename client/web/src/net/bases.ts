import type { HairBasis } from "../hair/basis";
import { HairnetError } from "../hair/hairnetError";
import type { Skin } from "../hair/skin";
import { decodeBasis } from "./basisFile";
import { CoefficientCode } from "./codec/coefficientCode";
import type { GroomFetched } from "./events";
import type { GroomHash } from "./groomHash";
import type { GroomBasis } from "./messages";

// Between two requests for one basis: a server that sends too much already refuses.
const kAskAgainNs = 2e9;

/** The data for decoding frames of a groom. Immutable. */
export interface KnownBasis extends HairBasis {
  readonly code: CoefficientCode;
}

interface Entry {
  readonly file: GroomHash;
  basis: KnownBasis | null;
  isUnusable: boolean;
  askedNs: number;
}

/** The bases of grooms, as the server announced them and as they have arrived. */
export class Bases {
  /** by groom */
  readonly #entries = new Map<GroomHash, Entry>();
  /** by file: a session that is lost may come back with the same bases, whose hair then continues */
  readonly #used = new Map<GroomHash, WeakRef<KnownBasis>>();

  /**
   * The server announces the same basis again over each connection. Another one replaces the basis that is here: its
   * coefficients mean other shapes.
   */
  announce({ groom, basis }: GroomBasis): void {
    if (this.#entries.get(groom)?.file === basis) return;
    const used = this.#used.get(basis)?.deref() ?? null;
    this.#entries.set(groom, { file: basis, basis: used, isUnusable: false, askedNs: -Infinity });
  }

  /**
   * The file to ask for, once a frame needs it; null while the basis is here, cannot be used, was not announced, or was
   * asked for a moment ago.
   */
  wanted(groom: GroomHash, nowNs: number): GroomHash | null {
    const entry = this.#entries.get(groom);
    if (!entry || entry.basis || entry.isUnusable || nowNs - entry.askedNs < kAskAgainNs) return null;
    entry.askedNs = nowNs;
    return entry.file;
  }

  /** The grooms whose basis the file of this hash is. */
  groomsOf(file: GroomHash): GroomHash[] {
    return [...this.#entries].filter(([, entry]) => entry.file === file).map(([groom]) => groom);
  }

  /** Takes the file of a basis, which several grooms may have. Returns why it cannot be used; empty: it can. */
  take({ hash, bytes, fault }: GroomFetched): string {
    if (!bytes) return fault;
    const entries = [...this.#entries.values()].filter((entry) => entry.file === hash);
    try {
      const hair = decodeBasis(bytes);
      const basis = { ...hair, code: new CoefficientCode(hair.basis.deviationM) };
      for (const entry of entries) entry.basis = basis;
      for (const [file, used] of this.#used) if (!used.deref()) this.#used.delete(file);
      this.#used.set(hash, new WeakRef(basis));
      return "";
    } catch (error) {
      if (!(error instanceof HairnetError)) throw error;
      for (const entry of entries) entry.isUnusable = true;
      return error.message;
    }
  }

  /** Null: not here. */
  of(groom: GroomHash): KnownBasis | null {
    return this.#entries.get(groom)?.basis ?? null;
  }

  /** The skin of the groom's body; null: its basis is not here. */
  skinOf(groom: GroomHash): Skin | null {
    return this.#entries.get(groom)?.basis?.skin ?? null;
  }

  /** The session is lost. Returns the files that were announced. */
  clear(): GroomHash[] {
    const files = [...this.#entries.values()].map((entry) => entry.file);
    this.#entries.clear();
    return files;
  }
}
