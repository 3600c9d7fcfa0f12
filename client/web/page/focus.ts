import type { Vector3 } from "three";
import { Bone, kNumbersPerBone, type Member } from "../src/index";
import type { HairCharacter } from "../src/scene/index";
import { boxOf, clearBearing, clearSwing, type Place, type Portrait, portraitOf } from "./framing";
import { yawOf } from "./head/headPose";
import { CentralPerson } from "./centralPerson";
import { kViewHeightRad, type Stage } from "./stage";

/** With others around, the slow orbit goes at most this far to both sides of its first bearing. */
const kSwingMaxRad = 0.6;
/** The camera orbits all around a person who has nobody else within this distance. */
const kAloneM = 2.5;

/** A person of the room that the camera can show. */
export interface Shown {
  readonly member: Member;
  readonly character: HairCharacter;
}

/**
 * Decides whom the camera shows. At first a portrait of one person, with a slow orbit; then whom the user chooses, or
 * everyone.
 */
export class Focus {
  /** The member number of the shown person; null: everyone is shown, or nobody is there yet. */
  person: number | null = null;
  readonly #central = new CentralPerson();
  /** The user chose this view: a person, or everyone. */
  #isChosen = false;
  /** What the last framing depended on, as a text; "": the next picture frames again. */
  #framed = "";
  /** Somebody was in the last picture. */
  #isDrawn = false;

  constructor(
    private readonly stage: Stage,
    private readonly onChange: (person: number | null) => void,
  ) {}

  show(person: number): void {
    this.#choose(person);
  }

  showAll(): void {
    this.#choose(null);
  }

  /** Back to the first view. */
  restart(): void {
    this.#choose(null);
    this.#isChosen = false;
  }

  /** Call it before each picture, with everyone who has a pose, and how many have none yet. */
  update(shown: readonly Shown[], comingCount: number, dtS: number): void {
    this.#move(shown, comingCount, dtS);
    this.#isDrawn = shown.some(({ character }) => character.isReady);
  }

  #move(shown: readonly Shown[], comingCount: number, dtS: number): void {
    const mayFrame = !this.stage.isMoved;
    let one = shown.find(({ member }) => member.member === this.person);
    const central = this.#central.choose(shown, comingCount, dtS);
    if (mayFrame && !this.#isChosen && !one?.character.isReady) one = central ?? one;
    if ((one?.member.member ?? null) !== this.person) this.#set(one?.member.member ?? null);
    const { width, height } = this.stage.free;
    if (!one) {
      const ready = shown.filter(({ character }) => character.isReady);
      const here = ready.map(({ member }) => member.member).join();
      if (mayFrame && this.#isChanged(`all ${here} in ${width} ${height}`))
        this.stage.frame(ready.map(({ character }) => character.position.clone()));
      return;
    }
    // The scale of a character is the size of its head: an avatar's head may be larger or smaller than the groom's.
    const portrait = portraitOf(one.member.groom, one.character.scale.y);
    // The text names all that the framing depends on. The first view must also avoid people who hide this person, so a
    // changed number of people frames it again. Newcomers do not change a view that the user chose.
    const others = this.#isChosen ? "" : `of ${shown.length}`;
    if (mayFrame && this.#isChanged(`${this.person} ${others} as ${portrait.bottom.toFixed(2)} in ${width} ${height}`))
      this.#flyTo(one, shown, portrait);
    if (mayFrame || this.#isChosen) this.stage.motion.follow(targetOf(one, portrait), dtS);
  }

  #choose(person: number | null): void {
    this.#isChosen = true;
    this.stage.isMoved = false;
    this.#framed = "";
    this.#set(person);
  }

  #isChanged(framed: string): boolean {
    if (framed === this.#framed) return false;
    this.#framed = framed;
    return true;
  }

  #set(person: number | null): void {
    this.person = person;
    this.onChange(person);
  }

  #flyTo(one: Shown, shown: readonly Shown[], portrait: Portrait): void {
    const { motion } = this.stage;
    const target = targetOf(one, portrait);
    const distance = this.stage.distanceFor(boxOf(portrait));
    const others = shown.filter((other) => other !== one).map((other) => placeOf(other));
    const at = placeOf(one);
    const bearing = clearBearing(at, headingOf(one), others, distance);
    const view = { target, bearing, height: kViewHeightRad, distance };
    // A flight from an empty view would only delay the first sight of a person: the camera jumps.
    if (this.#isDrawn) motion.flyTo(view);
    else motion.set(view);
    if (this.#isChosen) return;
    const isAlone = others.every(({ x, z }) => Math.hypot(x - at.x, z - at.z) > kAloneM);
    motion.orbitSlowly(isAlone ? Infinity : clearSwing(at, bearing, others, distance, kSwingMaxRad));
  }
}

function placeOf({ character }: Shown): Place {
  return character.position;
}

function targetOf({ character }: Shown, { bottom, top }: Portrait): Vector3 {
  const target = character.position.clone();
  target.y += (bottom + top) / 2;
  return target;
}

/** The direction of the trunk: it turns less than the head. */
function headingOf({ member, character }: Shown): number {
  const { x, y, z, w } = character.quaternion;
  const at = Bone.upperTrunk * kNumbersPerBone;
  const { pose } = member;
  return yawOf(pose ? [pose[at], pose[at + 1], pose[at + 2], pose[at + 3]] : [x, y, z, w]);
}
