import type { LevelGeometry } from "../hair/lattice";
import type { ErrorClass } from "../hair/level";
import type { GroomHash } from "./groomHash";
import type { HairState } from "./messages";

const kLatticeWaitNs = 1_000_000_000;

/** A lattice as a frame gave it. */
export interface Hair {
  readonly groom: GroomHash;
  readonly errorClass: ErrorClass;
  readonly state: HairState;
  readonly geometry: LevelGeometry;
}

/**
 * The hair of own characters when their server was lost. Another server knows it, but has no lattice before it has the
 * groom: what it sends until then is rigid, and this is shown in its place.
 */
export class KeptHair {
  readonly #kept = new Map<number, { readonly hair: Hair; untilNs: number }>();

  keep(character: number, hair: Hair): void {
    this.#kept.set(character, { hair, untilNs: Infinity });
  }

  drop(character: number): void {
    this.#kept.delete(character);
  }

  dropOf(groom: GroomHash): void {
    for (const [character, kept] of this.#kept) {
      if (kept.hair.groom === groom) this.#kept.delete(character);
    }
  }

  dropAll(): void {
    this.#kept.clear();
  }

  /** The lattice comes now; or a while later it does not, because the server has its reasons. */
  onReady(groom: GroomHash, nowNs: number): void {
    for (const kept of this.#kept.values()) {
      if (kept.hair.groom === groom && kept.untilNs === Infinity) kept.untilNs = nowNs + kLatticeWaitNs;
    }
  }

  of(character: number, nowNs: number): Hair | null {
    const kept = this.#kept.get(character);
    return kept && nowNs < kept.untilNs ? kept.hair : null;
  }
}
