import type { Downloads } from "../src/index";

/** What the page waits for before everyone is in the picture. */
export interface Waiting {
  readonly isConnected: boolean;
  /** All people who are awaited; those whose hairstyle has arrived; and those who can be drawn. */
  readonly people: number;
  readonly withGroom: number;
  readonly ready: number;
  readonly downloads: Downloads;
  /** How far the building of levels is, 0 to 1; null: no levels are being built. */
  readonly building: number | null;
}

export const kConnecting = { text: "Connecting to the room", share: null };

/**
 * A line that says what the page does, and the share of this that is done: 0 to 1, or null where it is not known. No
 * line (null) means that the page waits for nothing.
 */
export function loadingWords(waiting: Waiting): { text: string; share: number | null } | null {
  const { isConnected, people, withGroom, ready, downloads, building } = waiting;
  if (!isConnected) return kConnecting;
  if (withGroom < people) {
    const { bytes, byteCount } = downloads;
    if (byteCount === 0) return { text: "Downloading hairstyles", share: null };
    return {
      text: `Downloading hairstyles: ${megabytes(bytes)} of ${megabytes(byteCount)} MB`,
      share: bytes / byteCount,
    };
  }
  if (ready < people) return { text: `Preparing hair: ${ready} of ${people} heads`, share: ready / people };
  if (building !== null) return { text: "Preparing how the hair moves", share: building };
  return null;
}

function megabytes(bytes: number): string {
  return (bytes / 1e6).toFixed(1);
}

/** The line over the picture that `index.html` shows before any script has run. */
export class LoadingLine {
  readonly #text: HTMLElement;
  readonly #bar: HTMLProgressElement;

  constructor(private readonly line: HTMLElement) {
    this.#text = line.querySelector("span")!;
    this.#bar = line.querySelector("progress")!;
  }

  get isShown(): boolean {
    return !this.line.hidden;
  }

  /** Shows the result of `loadingWords`; null hides the line. */
  show(words: { text: string; share: number | null } | null): void {
    this.line.hidden = words === null;
    if (!words) return;
    if (this.#text.textContent !== words.text) this.#text.textContent = words.text;
    if (words.share === null) this.#bar.removeAttribute("value");
    else this.#bar.value = words.share;
  }
}
