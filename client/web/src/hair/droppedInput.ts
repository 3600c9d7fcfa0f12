/**
 * Counts input of a program that was dropped instead of ending its render loop, such as a pose that is not finite, and
 * tells of it on the console: at most once a second.
 */
export class DroppedInput {
  #count = 0;
  /** The time of the last line on the console about dropped input, by performance.now(). */
  #warnedMs = -Infinity;
  /** The lines that `tellOnce` has written. */
  readonly #warnedOnce = new Set<string>();

  get count(): number {
    return this.#count;
  }

  /** Counts dropped input. `what` says in one line which input it is and what is wrong with it. */
  drop(what: string): void {
    this.#count += 1;
    const nowMs = performance.now();
    if (nowMs - this.#warnedMs < 1000) return;
    this.#warnedMs = nowMs;
    tell(`${what}; it was dropped (${this.#count} so far)`);
  }

  /** Tells once of something that lasts until the program changes it. It is not counted. */
  tellOnce(what: string): void {
    if (this.#warnedOnce.has(what)) return;
    this.#warnedOnce.add(what);
    tell(what);
  }
}

function tell(line: string): void {
  // biome-ignore lint/suspicious/noConsole: it is for the program's author, who may listen to no event.
  console.warn(`hairnet: ${line}`);
}

/** Names the first number that is not finite, also within lists: "speed is NaN". Null: all numbers are finite. */
export function notFinite(values: object): string | null {
  for (const [name, value] of Object.entries(values)) {
    const numbers: readonly unknown[] =
      ArrayBuffer.isView(value) || Array.isArray(value) ? [...(value as number[])] : [value];
    const wrong = numbers.find((number) => typeof number === "number" && !Number.isFinite(number));
    if (wrong !== undefined) return `${name} is ${String(wrong)}`;
  }
  return null;
}
