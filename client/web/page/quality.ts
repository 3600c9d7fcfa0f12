const kSlowMs = 28;
const kFastMs = 17.5; // 60 pictures a second, when the screen shows no more
const kLeast = 0.12;
const kMost = 1.5;

/** Chooses how finely hair is drawn so that pictures keep coming. */
export class Quality {
  /** null: automatic */
  chosen: number | null = null;
  #automatic = 0.7;
  #meanMs = 20;
  #settled = 0;

  get value(): number {
    return this.chosen ?? this.#automatic;
  }

  /** Milliseconds from one picture to the next. */
  add(frameMs: number): void {
    if (frameMs > 1000) return; // the page was hidden
    this.#meanMs += 0.1 * (frameMs - this.#meanMs);
    if (++this.#settled < 12) return;
    if (this.#meanMs > kSlowMs) this.#change(Math.max(0.6, kSlowMs / this.#meanMs));
    else if (this.#meanMs < kFastMs) this.#change(1.05);
  }

  #change(factor: number): void {
    const before = this.#automatic;
    this.#automatic = Math.min(Math.max(before * factor, kLeast), kMost);
    this.#settled = 0;
  }
}
