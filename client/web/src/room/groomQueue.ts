// The first request waits until heights were told twice: by the second time an application has placed its camera. One
// that tells none waits so long, and for so many calls, as pictures may be slow.
const kReports = 2;
const kWaitMs = 600;
const kWaitCalls = 4;

/** The grooms to fetch, one after the other: the first one is whole soon, where all at once would be whole at the end. */
export class GroomQueue {
  readonly #waiting = new Set<string>();
  /** height of the largest head with the groom over the screen's height; heads outside of the view count little */
  readonly #heights = new Map<string, number>();
  #current: string | null = null;
  #reports = 0;
  #calls = 0;
  /** when the first groom began to wait */
  #beganMs: number | null = null;

  add(groom: string): void {
    if (groom !== this.#current) this.#waiting.add(groom);
  }

  /** Nobody needs it any more. A fetch that has begun continues. */
  remove(groom: string): void {
    this.#waiting.delete(groom);
  }

  /** It has arrived, or cannot. */
  finish(groom: string): void {
    this.#waiting.delete(groom);
    if (this.#current === groom) this.#current = null;
  }

  /** The heights of all grooms that are seen now. */
  setHeights(heights: Iterable<readonly [groom: string, height: number]>): void {
    this.#heights.clear();
    for (const [groom, height] of heights) this.#heights.set(groom, Math.max(height, this.#heights.get(groom) ?? 0));
    if (this.#heights.size > 0) ++this.#reports;
  }

  /** The groom to ask for now: `first`, or unless `onlyFirst` the largest on the screen; null while another is on its way. */
  next(nowMs: number, first: string | null = null, onlyFirst = false): string | null {
    if (this.#current !== null || this.#waiting.size === 0) return null;
    if (onlyFirst && (first === null || !this.#waiting.has(first))) return null;
    this.#beganMs ??= nowMs;
    ++this.#calls;
    const best = first !== null && this.#waiting.has(first) ? first : this.#largest(nowMs - this.#beganMs);
    if (best !== null) this.#waiting.delete(best);
    this.#current = best;
    return best;
  }

  #largest(waitedMs: number): string | null {
    if (this.#reports < kReports && (waitedMs < kWaitMs || this.#calls < kWaitCalls)) return null;
    const height = (groom: string) => this.#heights.get(groom) ?? 0;
    return [...this.#waiting].reduce((best, groom) => (height(groom) > height(best) ? groom : best));
  }
}
