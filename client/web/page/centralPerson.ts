import type { Vector3 } from "three";
import type { Place } from "./framing";
import type { Shown } from "./focus";

/** The speed of a head is averaged over this time, s. */
const kCalmS = 1;
/** The speed of a head counts as distance from the middle: 1 m/s as much as this number of metres. */
const kMovingM = 3;
/** Another person must be better by this number of metres, so that the choice does not alternate between two. */
const kBetterM = 0.3;
/** The choice waits this long for the hair of the chosen person while the hair of others can be drawn, s. */
const kWaitS = 3;
/** As long as somebody's first pose is on its way, the first choice waits for it, s. */
const kComingS = 0.5;

interface Head {
  readonly position: Vector3;
  /** The average of the last second or so, m/s; see kCalmS. */
  speed: number;
}

/** Chooses the person of the first view: oneself, or else the calmest and most central one. */
export class CentralPerson {
  /** All heads in the room, by member number. */
  readonly #heads = new Map<number, Head>();
  /** The member number of the last choice. */
  #person: number | null = null;
  /** How long hair of others can be drawn and that of the chosen person cannot, s; see kWaitS. */
  #waitedS = 0;
  /** How long the first choice has waited for people without a pose, s; see kComingS. */
  #gatheredS = 0;

  /**
   * Call it before each picture. `shown`: everyone who has a pose; `comingCount`: how many people have no pose yet.
   * Returns null when nobody is there. It also returns null while the first poses of others are awaited, since the
   * middle of the people depends on them.
   */
  choose(shown: readonly Shown[], comingCount: number, dtS: number): Shown | null {
    this.#watch(shown, dtS);
    const own = shown.find(({ member }) => member.own);
    if (own) return own;
    const ready = shown.filter(({ character }) => character.isReady);
    const before = shown.find(({ member }) => member.member === this.#person);
    if (before?.character.isReady) return before;
    this.#waitedS = ready.length > 0 ? this.#waitedS + dtS : 0;
    const candidates = this.#waitedS > kWaitS ? ready : shown.filter(({ member }) => !member.error);
    if (candidates.length === 0) return null;
    if (this.#person === null && comingCount > 0 && this.#gatheredS < kComingS) {
      this.#gatheredS += dtS;
      return null;
    }
    const middle = middleOf(shown);
    const away = (one: Shown) => this.#distance(one, middle);
    const best = candidates.reduce((a, b) => (away(b) < away(a) ? b : a));
    const stays = before && candidates.includes(before) && away(before) < away(best) + kBetterM;
    const chosen = stays ? before : best;
    this.#person = chosen.member.member;
    return chosen;
  }

  /** Measures how fast each head moves, as a running average, and forgets people who have left. */
  #watch(shown: readonly Shown[], dtS: number): void {
    const present = new Set(shown.map(({ member }) => member.member));
    for (const person of this.#heads.keys()) if (!present.has(person)) this.#heads.delete(person);
    for (const { member, character } of shown) {
      const head = this.#heads.get(member.member);
      if (!head) this.#heads.set(member.member, { position: character.position.clone(), speed: 0 });
      else if (dtS > 0) {
        const share = Math.min(dtS / kCalmS, 1);
        head.speed += share * (head.position.distanceTo(character.position) / dtS - head.speed);
        head.position.copy(character.position);
      }
    }
  }

  /** How far a person is from the middle on the ground, m, where motion counts as distance. */
  #distance({ member, character: { position } }: Shown, middle: Place): number {
    const away = Math.hypot(position.x - middle.x, position.z - middle.z);
    return away + kMovingM * (this.#heads.get(member.member)?.speed ?? 0);
  }
}

function middleOf(shown: readonly Shown[]): Place {
  const middle = { x: 0, z: 0 };
  for (const { character } of shown) {
    middle.x += character.position.x / shown.length;
    middle.z += character.position.z / shown.length;
  }
  return middle;
}
