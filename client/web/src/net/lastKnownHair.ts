import type { HairBasis } from "../hair/basis";
import { LevelIndex } from "../hair/level";
import type { GroomHash } from "./groomHash";
import type { HairState } from "./messages";

const kLatticeWaitNs = 1_000_000_000;

/** The hair of one frame. */
export interface HairSnapshot {
  readonly groom: GroomHash;
  readonly basis: HairBasis;
  readonly coefficients: Float32Array;
  /** the same, for the server */
  readonly state: HairState;
}

interface Kept {
  readonly hair: HairSnapshot;
  /** the server has the groom */
  isReady: boolean;
  untilNs: number;
}

/**
 * The last known hair of this client's own characters, taken when the connection was lost. A new server has no lattice
 * until it has the groom, so it sends rigid frames at first. This hair is shown in their place.
 */
export class LastKnownHair {
  readonly #lastKnown = new Map<number, Kept>();

  keep(character: number, hair: HairSnapshot): void {
    this.#lastKnown.set(character, { hair, isReady: false, untilNs: Infinity });
  }

  drop(character: number): void {
    this.#lastKnown.delete(character);
  }

  dropOf(groom: GroomHash): void {
    for (const [character, kept] of this.#lastKnown) {
      if (kept.hair.groom === groom) this.#lastKnown.delete(character);
    }
  }

  /** The connection is lost: what is still shown waits for the next server's lattice from its beginning. */
  onLost(): void {
    for (const [character, { hair }] of this.#lastKnown) this.keep(character, hair);
  }

  /**
   * The server has the groom, so its lattice frames should follow. If they are still rigid a second after the first one
   * (the server may keep the character rigid), the last known hair is no longer shown.
   */
  onReady(groom: GroomHash): void {
    for (const kept of this.#lastKnown.values()) kept.isReady ||= kept.hair.groom === groom;
  }

  /** To show with a frame of this level that has no hair: because it is rigid, or because its basis is on its way. */
  of(character: number, level: LevelIndex, nowNs: number): HairSnapshot | null {
    const kept = this.#lastKnown.get(character);
    if (!kept) return null;
    if (level !== LevelIndex.rigid) return kept.hair;
    if (kept.isReady && kept.untilNs === Infinity) kept.untilNs = nowNs + kLatticeWaitNs;
    if (nowNs < kept.untilNs) return kept.hair;
    this.#lastKnown.delete(character);
    return null;
  }
}
