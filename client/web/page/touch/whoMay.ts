import { type OwnCharacter, type Room, TouchAudience } from "../../src/index";

/** Who may touch the own hair, as the page offers it. */
const kAudiences = ["nobody", "oneself", "everyone"] as const satisfies readonly (keyof typeof TouchAudience)[];
export type Audience = (typeof kAudiences)[number];
/** What a room assumes for a character whose owner has said nothing. */
const kDefault: Audience = "oneself";

/** The audience that the page has stored, or the default: other pages of the same origin may have written anything. */
export function audienceOf(word: string): Audience {
  return kAudiences.find((audience) => audience === word) ?? kDefault;
}

/** Tells rooms who may touch the own hair. */
export class WhoMay {
  #own: OwnCharacter | null = null;
  /** What the room knows of the own character `#own`. */
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
