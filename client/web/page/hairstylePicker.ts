import { Vector3 } from "three";
import { Member, type CharacterOptions, type MaterialScale, type OwnCharacter, type People } from "../src/index";
import { fileHairstyle, listedHairstyles, roomHairstyles, type Hairstyle } from "./hairstyles";
import type { OwnHead } from "./head/ownHead";
import { hairstyleName } from "./roomDetails";
import { kHeadInVrM } from "./stage";
import { messageOf } from "./errorWords";

/** Characters stand at least about this far apart: shoulders have room beside each other. */
const kPlaceApartM = 0.6;
/**
 * A user joins this long after the room was entered. By then the server has usually announced the members, whose names,
 * hairstyles and places the user's own must differ from.
 */
const kAcquaintedMs = 700;

/** The hairstyles that the user can choose, and the one that the user's own character has. */
export class HairstylePicker {
  own: OwnCharacter | null = null;
  /** The room's members are known by now, so a room without members is empty. */
  isAcquainted = false;
  #room: People | null = null;
  /** The user's choice, which outlives the room; null: the user only watches. */
  #wanted: Hairstyle | null = null;
  /** Ends when `isAcquainted` becomes true. */
  #acquainted: Promise<void> = Promise.resolve();
  /** The server's own hairstyles. */
  #listed: Hairstyle[] = [];
  /** Hairstyles of files that the user has given. */
  #files: Hairstyle[] = [];
  /** All hairstyles, in the order of the select's options after the first one. */
  #offered: Hairstyle[] = [];
  /** The number of the newest request to read files. An older request that ends later changes nothing. */
  #request = 0;
  /** The user wants to join, and no hairstyle is known yet. */
  #joinsLater = false;

  constructor(
    private readonly select: HTMLSelectElement,
    private readonly head: OwnHead,
    private readonly materialOf: () => MaterialScale,
    private readonly optionsOf: () => CharacterOptions,
    private readonly onError: (detail: string) => void,
    private readonly isLocal: boolean,
  ) {
    select.addEventListener("change", () => void this.choose(this.#offered[select.selectedIndex - 1] ?? null));
  }

  /** Reads the list of the server's hairstyles. */
  async start(): Promise<void> {
    this.#listed = await listedHairstyles(this.isLocal);
    this.offer();
  }

  /** The own hairstyle carries over to the next room. */
  enter(room: People): void {
    this.#room = room;
    this.own = null;
    this.isAcquainted = false;
    this.#acquainted = new Promise((done) => setTimeout(done, kAcquaintedMs)).then(() => {
      if (room === this.#room) this.isAcquainted = true;
    });
    if (this.#wanted) void this.choose(this.#wanted);
  }

  leave(): void {
    this.#room = null;
    this.own = null;
  }

  get hasHairstyle(): boolean {
    return this.#wanted !== null;
  }

  /** There is a hairstyle to join with. */
  get canJoin(): boolean {
    return this.#listed.length > 0 || this.#offered.length > 0;
  }

  /**
   * Chooses the hairstyle that the fewest people in the room have: one of the server's own hairstyles if there are any.
   * Where no hairstyle is known yet, the user joins when `offer` lists the first ones. A user who has a hairstyle keeps
   * it.
   */
  join(): void {
    if (this.#wanted) return;
    const used = [...(this.#room?.members.values() ?? [])].map(({ groom }) => hairstyleName(groom?.name ?? ""));
    const from = this.#listed.length > 0 ? this.#listed : this.#offered;
    const hairstyle = leastUsed(from, ({ label }) => used.filter((name) => name === label).length);
    if (hairstyle) void this.choose(hairstyle);
    else this.#joinsLater = true;
  }

  /**
   * Gives the user this hairstyle, in this room and in later ones; null: the user only watches. In a room the own
   * character is replaced: it joins as soon as the members are known.
   */
  async choose(hairstyle: Hairstyle | null): Promise<void> {
    this.#wanted = hairstyle;
    this.#joinsLater = false;
    this.offer();
    const room = this.#room;
    if (!room) return;
    try {
      const hair = hairstyle ? await hairstyle.get() : null;
      await this.#acquainted;
      if (room !== this.#room || hairstyle !== this.#wanted) return;
      const isFirst = this.own === null;
      if (this.own) room.removeCharacter(this.own);
      this.own = null;
      if (!hair) return;
      if (isFirst) this.#takePlace(room);
      const options = this.optionsOf();
      if (hair instanceof Member) this.own = room.addCharacterLike(hair, options);
      else {
        const files = hair.levels ? { levels: hair.levels } : {};
        this.own = room.addCharacter(hair.groom, { ...options, ...files });
      }
      this.own.setMaterial(this.materialOf());
    } catch (error) {
      this.#wanted = null;
      this.offer();
      this.onError(messageOf(error));
    }
  }

  /**
   * Chooses the hairstyle of files, unless the user gives other files meanwhile. `onRead` gets lines of what the
   * importer guessed, and no line after an error.
   */
  async takeFiles(files: readonly File[], onRead: (remarks: readonly string[]) => void): Promise<void> {
    const request = ++this.#request;
    try {
      const { style, remarks } = await fileHairstyle(files);
      if (request !== this.#request) return;
      this.#files = [style, ...this.#files.filter((other) => other.label !== style.label)];
      onRead(remarks);
      await this.choose(style);
    } catch (error) {
      if (request !== this.#request) return;
      onRead([]);
      this.onError(messageOf(error));
    }
  }

  /** Lists the hairstyles: dropped files, the server's, those in the room. Call it now and then. */
  offer(): void {
    const { select } = this;
    this.#offered = [...this.#files, ...this.#listed, ...roomHairstyles(this.#room?.members.values() ?? [])];
    const labels = ["none (watch)", ...this.#offered.map((style) => style.label)];
    const before = [...select.options].map((option) => option.text);
    if (labels.length !== before.length || labels.some((label, n) => label !== before[n]))
      select.replaceChildren(...labels.map((label) => new Option(label)));
    const chosen = this.#wanted?.label;
    select.selectedIndex = Math.max(chosen ? labels.indexOf(chosen) : 0, 0);
    if (this.#joinsLater) this.join();
  }

  // Finds a free place beside the other characters, at their mean height. It tries x = 0, -0.6, 0.6, -1.2 m and so on.
  // After 200 places, which is 60 m to each side, the head stays where it is.
  #takePlace(room: People): void {
    const others = [...room.members.values()].flatMap(({ own, pose }) => (pose && !own ? [pose] : []));
    const height = others.length > 0 ? others.reduce((sum, pose) => sum + pose[5], 0) / others.length : kHeadInVrM;
    for (let n = 0; n < 200; ++n) {
      const side = n % 2 === 0 ? 1 : -1;
      const place = new Vector3(side * Math.ceil(n / 2) * kPlaceApartM, height, 0);
      // pose[4] and pose[6] are the head's x and z. 5 cm less are enough: a head that sways a little takes one place.
      if (others.some((pose) => Math.hypot(pose[4] - place.x, pose[6] - place.z) < kPlaceApartM - 0.05)) continue;
      this.head.placeAt(place, 0);
      return;
    }
  }
}

/** The choice that the fewest people have, the first of several; null: there is no choice. `used`: how many have it. */
export function leastUsed<Choice>(choices: readonly Choice[], used: (choice: Choice) => number): Choice | null {
  const counts = choices.map(used);
  return choices[counts.indexOf(Math.min(...counts))] ?? null;
}
