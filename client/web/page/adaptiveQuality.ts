/** Quality falls while the median frame takes longer than this, which is 36 frames a second. */
const kSlowMs = 28;
/** Quality rises while the median frame is faster: 60 frames a second take 16.7 ms, and many screens show no more. */
const kFastMs = 17.5;
/** A longer frame counts as this one: the page was hidden, or did something else. */
const kFrameMsMax = 1000;
/** With a lower quality, cards would replace the hair of a head that fills the view. */
const kMin = 0.4;
const kMax = 1.5;

/** Lowers the drawing quality while pictures take too long, and raises it again. Changes gradually. */
export class AdaptiveQuality {
  /** The quality that the user has chosen; null: this class chooses it. */
  chosen: number | null = null;
  /** The start is below the full quality of 1, so that the first frames are smooth on slow machines, too. */
  #automatic = 0.7;
  /** The times of the frames since the last decision, ms. */
  #frames: number[] = [];

  get value(): number {
    return this.chosen ?? this.#automatic;
  }

  /** `frameMs`: the time from one picture to the next. */
  add(frameMs: number): void {
    if (document.visibilityState === "hidden") return;
    this.#frames.push(Math.min(frameMs, kFrameMsMax));
    const sum = this.#frames.reduce((a, b) => a + b);
    // Waits for half a second of pictures, or for three very slow ones, because a single one may be slow for another
    // reason.
    if (this.#frames.length < 3 || (sum < 500 && this.#frames.length < 30)) return;
    const median = this.#frames.sort((a, b) => a - b)[this.#frames.length >> 1];
    this.#frames = [];
    // Quality falls by up to a half at once, and rises by 5 % at a time.
    if (median > kSlowMs) this.#change(Math.max(0.5, kSlowMs / median));
    else if (median < kFastMs) this.#change(1.05);
  }

  #change(factor: number): void {
    this.#automatic = Math.min(Math.max(this.#automatic * factor, kMin), kMax);
  }
}
