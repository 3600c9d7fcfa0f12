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

  /** What everyone in the room gets to know. */
  get options(): CharacterOptions {
    return { tag: this.name, appearance: this.#appearance };
  }

  /** The options of a user who joins. Without a name they get one that nobody else in the room has. */
  named(taken: readonly string[]): CharacterOptions {
    if (!this.name) this.input.value = pickName(new Set(taken));
    return this.options;
  }

  /** `hairRoot`: sRGB, 0xrrggbb, of the whole hair. */
  setHairColour(hairRoot: number): void {
    this.#appearance = { hairRoot, hairTip: hairRoot };
    this.onChange(this.options);
  }
}
