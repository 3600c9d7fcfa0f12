import { Color } from "three";
import type { HairCharacter } from "../src/scene/index";
import type { People } from "../src/index";
import { personName } from "./roomDetails";

/**
 * The list of the people in the room. Each has a button that shows the person, and a swatch with the colour of the
 * person's hair. The user's own swatch changes the colour for everyone, and the others for this page alone.
 */
export class MemberList {
  /** The rows of the list by member number. */
  readonly #rows = new Map<number, { row: HTMLLIElement; swatch: HTMLInputElement; button: HTMLButtonElement }>();

  constructor(
    private readonly list: HTMLUListElement,
    private readonly onChoose: (member: number) => void,
    /** Gets the new colour of the user's own hair, sRGB, 0xrrggbb. */
    private readonly onOwnColour: (hairRoot: number) => void,
  ) {}

  /** Adds the row of a character that has come. */
  add(character: HairCharacter): void {
    const row = document.createElement("li");
    const swatch = document.createElement("input");
    swatch.type = "color";
    swatch.value = `#${character.hairColour.getHexString()}`;
    swatch.addEventListener("input", () => {
      const colour = new Color(swatch.value);
      if (character.own) this.onOwnColour(colour.getHex());
      else character.hairColour.copy(colour);
    });
    const button = document.createElement("button");
    button.type = "button";
    button.addEventListener("click", () => this.onChoose(character.member));
    row.append(swatch, button);
    row.dataset.member = String(character.member);
    this.#rows.set(character.member, { row, swatch, button });
    this.list.append(row);
  }

  remove(character: HairCharacter): void {
    this.#rows.get(character.member)?.row.remove();
    this.#rows.delete(character.member);
  }

  clear(): void {
    this.list.replaceChildren();
    this.#rows.clear();
  }

  /** Shows the name of each person, and what its hair waits for. `shown`: the person whom the camera shows. */
  refresh(room: People, characters: ReadonlyMap<number, HairCharacter>, shown: number | null): void {
    for (const [number, { swatch, button }] of this.#rows) {
      const member = room.members.get(number);
      const character = characters.get(number);
      if (!member || !character) continue;
      const name = personName(member);
      const waits = member.error || (!member.groom ? "hair is on its way" : character.isReady ? "" : "getting ready");
      const text = waits ? `${name}: ${waits}` : name;
      if (button.textContent !== text) {
        button.textContent = text;
        button.title = `Show ${name}`;
        swatch.title = member.own
          ? "Colour of your hair, for everyone"
          : `Colour of the hair of ${name}, for you alone`;
        swatch.setAttribute("aria-label", swatch.title);
      }
      const colour = `#${character.hairColour.getHexString()}`;
      if (swatch.value !== colour && document.activeElement !== swatch) swatch.value = colour;
      button.setAttribute("aria-pressed", String(shown === number));
    }
  }
}
