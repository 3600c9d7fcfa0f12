import type { Appearance, CharacterOptions } from "../src/index";
import { keepName, keptName, pickName } from "./names";

/** Who the user is to everyone in the room: a name and the colour of the hair. */
export class Identity {
  #appearance: Partial<Appearance> | undefined;

  constructor(
    private readonly input: HTMLInputElement,
    private readonly onChange: (options: CharacterOptions) => void,
  ) {
    input.value = keptName();
    input.addEventListener("change", () => {
      keepName(this.name);
      this.onChange(this.options);
    });
  }

  get name(): string {
    return this.input.value.trim();
  }

  /** How the own character is added. */
  get options(): CharacterOptions {
    return { tag: this.name, appearance: this.#appearance };
  }

  /** A user without a name gets one that nobody else in the room has. */
  pickName(taken: ReadonlySet<string>): void {
    if (!this.name) this.input.value = pickName(taken);
  }

  /** `hairRoot`: sRGB, 0xrrggbb, of the whole hair. */
  setHairColour(hairRoot: number): void {
    this.#appearance = { hairRoot, hairTip: hairRoot };
    this.onChange(this.options);
  }
}
