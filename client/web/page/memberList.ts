import { Color } from "three";
import type { HairCharacter } from "../src/scene/index";
import type { Room } from "../src/index";

/** The members of the room: a click follows a member, the swatch has the colour in which its hair is drawn here. */
export class MemberList {
  followed: number | null = null;
  readonly #rows = new Map<number, HTMLLIElement>();

  constructor(private readonly list: HTMLUListElement) {}

  add(character: HairCharacter): void {
    const row = document.createElement("li");
    const swatch = document.createElement("input");
    swatch.type = "color";
    swatch.title = "Colour of the hair, here";
    swatch.value = `#${character.hairColour.getHexString()}`;
    swatch.addEventListener("input", () => character.hairColour.copy(new Color(swatch.value)));
    const button = document.createElement("button");
    button.type = "button";
    button.addEventListener("click", () => this.#follow(character.member));
    row.append(swatch, button);
    row.dataset.member = String(character.member);
    this.#rows.set(character.member, row);
    this.list.append(row);
  }

  remove(character: HairCharacter): void {
    this.#rows.get(character.member)?.remove();
    this.#rows.delete(character.member);
    if (this.followed === character.member) this.followed = null;
  }

  clear(): void {
    this.list.replaceChildren();
    this.#rows.clear();
    this.followed = null;
  }

  /** The current label of each: its hairstyle, and what it waits for. */
  refresh(room: Room, characters: ReadonlyMap<number, HairCharacter>): void {
    for (const [number, row] of this.#rows) {
      const member = room.members.get(number);
      const character = characters.get(number);
      const button = row.querySelector("button");
      if (!button || !member || !character) continue;
      const name = `${member.groom?.name || "hairstyle"} ${number}${member.own ? " (you)" : ""}`;
      const waits = member.fault || (!member.groom ? "fetching hair" : character.isReady ? "" : "no pose yet");
      const text = waits ? `${name}: ${waits}` : name;
      if (button.textContent !== text) button.textContent = text;
      button.setAttribute("aria-pressed", String(this.followed === number));
    }
  }

  #follow(member: number): void {
    this.followed = this.followed === member ? null : member;
  }
}
