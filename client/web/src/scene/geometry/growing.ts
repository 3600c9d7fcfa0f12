type Numbers = Float32Array | Uint32Array | Uint16Array | Uint8Array;

/** A typed array that grows at its end. */
export class Growing<T extends Numbers> {
  length = 0;
  #values: T;

  constructor(private readonly make: (length: number) => T) {
    this.#values = make(1024);
  }

  /** Makes room for `count` more numbers at the old `length`, and adds `count` to `length`. */
  extend(count: number): T {
    const length = this.length + count;
    if (length > this.#values.length) {
      const larger = this.make(Math.max(length, 2 * this.#values.length));
      larger.set(this.#values as never);
      this.#values = larger;
    }
    this.length = length;
    return this.#values;
  }

  push(...numbers: number[]): void {
    const at = this.length;
    this.extend(numbers.length).set(numbers, at);
  }

  /** A copy of the numbers that were put in. */
  take(): T {
    return this.#values.slice(0, this.length) as T;
  }
}

export const growingFloats = () => new Growing((length) => new Float32Array(length));
export const growingIndices = () => new Growing((length) => new Uint32Array(length));
export const growingHalves = () => new Growing((length) => new Uint16Array(length));
export const growingBytes = () => new Growing((length) => new Uint8Array(length));
