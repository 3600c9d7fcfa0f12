import { keep, kept } from "./kept";
import type { Touching, TouchHost } from "./touching";
import { audienceOf, WhoMay } from "./touch/whoMay";

/** The key of the user's choice in the browser's storage. */
const kKey = "hairnet.touch";

/** The section of the panel in which the user chooses who may touch the own hair, and ends pins. */
export class TouchPanel {
  readonly #whoMay = new WhoMay(audienceOf(kept(kKey)));

  constructor(
    private readonly host: TouchHost,
    private readonly touching: Touching,
    select: HTMLSelectElement,
    private readonly unpin: HTMLButtonElement,
  ) {
    select.value = this.#whoMay.audience;
    select.addEventListener("change", () => {
      this.#whoMay.audience = audienceOf(select.value);
      keep(kKey, this.#whoMay.audience);
    });
    unpin.addEventListener("click", () => touching.unpin());
  }

  /** Call it before each picture. */
  update(): void {
    const { served, own } = this.host;
    this.#whoMay.tell(served, own);
    this.unpin.hidden = !served || !(own || this.touching.hasPinned);
  }
}
