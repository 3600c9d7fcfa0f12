const kStalledNs = 60_000_000;
/** The growth of the remembered least lateness a frame: it follows clocks that drift apart. */
const kForgetNs = 100_000;

/**
 * Estimates when frames really arrived. The page's thread may block for a while (shader linking, GPU uploads); frames
 * that arrive meanwhile are all read afterwards, but were not late. Times in ns, of one clock.
 */
export class Arrivals {
  #awakeNs = -Infinity;
  #leastLatenessNs = Infinity;

  /** The thread runs at this moment. */
  onAwake(nowNs: number): void {
    this.#awakeNs = nowNs;
  }

  /** The estimated arrival of a frame that is read now; `sampleNs` is on this clock. */
  timeOf(sampleNs: number, nowNs: number): number {
    const stalled = nowNs - this.#awakeNs > kStalledNs;
    if (!stalled) {
      this.#awakeNs = nowNs;
      this.#leastLatenessNs = Math.min(this.#leastLatenessNs + kForgetNs, nowNs - sampleNs);
      return nowNs;
    }
    if (this.#leastLatenessNs === Infinity) return nowNs;
    // On time, unless the thread would have read it before it blocked.
    return Math.min(Math.max(sampleNs + this.#leastLatenessNs, this.#awakeNs), nowNs);
  }
}
