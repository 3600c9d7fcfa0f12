import { type OwnCharacter, type Room, TouchAudience } from "../../src/index";

/** Who may touch the own hair, as the page offers it. */
const kAudiences = ["nobody", "oneself", "everyone"] as const satisfies readonly (keyof typeof TouchAudience)[];
export type Audience = (typeof kAudiences)[number];
/** without a word from the owner */
const kDefault: Audience = "oneself";

/** A word that the page has kept, or the default: other pages of the same origin may have written anything there. */
export function audienceOf(word: string): Audience {
  return kAudiences.find((audience) => audience === word) ?? kDefault;
}

/** Tells rooms who may touch the own hair. */
export class WhoMay {
  #own: OwnCharacter | null = null;
  #announced: Audience = kDefault;

  constructor(public audience: Audience) {}

  /** Call it now and then: there is another character after another hairstyle, and in another room. */
  tell(room: Pick<Room, "setTouch"> | null, own: OwnCharacter | null): void {
    if (own !== this.#own) this.#announced = kDefault;
    this.#own = own;
    if (!room || !own || this.audience === this.#announced) return;
    room.setTouch(own, TouchAudience[this.audience]);
    this.#announced = this.audience;
  }
}
