import type { LevelGeometry } from "../hair/lattice";
import type { LevelIndex } from "../hair/level";
import { Neighbours } from "./codec/neighbours";
import type { GroomHash } from "./groomHash";
import type { LevelRecord } from "./messages";

/** What frames of a level are read with. Immutable. */
export interface KnownLevel {
  readonly geometry: LevelGeometry;
  readonly neighbours: Neighbours;
}

/**
 * The level records that were received. A record that is received again, for example after a reconnect, gives the same
 * object as long as something still uses it, so that what was built from it stays valid.
 */
export class LevelCatalog {
  readonly #levels = new Map<string, WeakRef<LevelGeometry>>();

  keep(record: LevelRecord): KnownLevel {
    const key = levelKey(record.groom, record.level);
    const before = this.#levels.get(key)?.deref();
    const geometry = before && isSame(before, record.geometry) ? before : record.geometry;
    // Another server may build the level differently: the new record wins.
    if (geometry !== before) this.#levels.set(key, new WeakRef(geometry));
    for (const [other, reference] of this.#levels) {
      if (!reference.deref()) this.#levels.delete(other);
    }
    return { geometry, neighbours: new Neighbours(geometry) };
  }
}

export const levelKey = (groom: GroomHash, level: LevelIndex): string => `${groom} ${level}`;

function isSame(a: LevelGeometry, b: LevelGeometry): boolean {
  return (
    isEqual(a.lattice.origin, b.lattice.origin) &&
    isEqual(a.lattice.spacing, b.lattice.spacing) &&
    isEqual(a.lattice.dims, b.lattice.dims) &&
    isEqual(a.activeNodes, b.activeNodes) &&
    isEqual(a.trimmedNodes, b.trimmedNodes) &&
    isEqual(a.trimmedBegin, b.trimmedBegin) &&
    isEqual(a.trimmedFrom, b.trimmedFrom) &&
    isEqual(a.trimmedWeights, b.trimmedWeights)
  );
}

function isEqual(a: ArrayLike<number>, b: ArrayLike<number>): boolean {
  if (a.length !== b.length) return false;
  for (let i = 0; i < a.length; ++i) {
    if (a[i] !== b[i]) return false;
  }
  return true;
}
