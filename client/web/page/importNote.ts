import { isolated } from "./isolated";

/** The line about files that were read disappears after this time; the details stay. */
const kLineShownMs = 12_000;

/**
 * What the page says of files of hair that the user gives: first that it reads them, then in one line how the hair was
 * taken to lie. All remarks of the importer are in the details below.
 */
export class ImportNote {
  #timer: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly line: HTMLElement,
    private readonly details: HTMLDetailsElement,
  ) {}

  showReading(names: readonly string[]): void {
    this.#showLine(`Reading ${names.map(isolated).join(", ")} …`);
  }

  /** `remarks`: the importer's lines; none for a hairstyle that needs no guess, and after an error. */
  show(remarks: readonly string[]): void {
    this.#showLine(remarks.length > 0 ? isolated(remarks[0]) : null);
    this.#timer = setTimeout(() => this.#showLine(null), kLineShownMs);
    this.details.hidden = remarks.length === 0;
    const items = remarks.map((remark) => {
      const item = document.createElement("li");
      item.textContent = isolated(remark);
      return item;
    });
    this.details.querySelector("ul")!.replaceChildren(...items);
  }

  #showLine(text: string | null): void {
    clearTimeout(this.#timer);
    this.line.hidden = text === null;
    this.line.textContent = text;
  }
}
