/**
 * Reads numbers from bytes, the lowest bit first. Beyond the end it reads zeros and remembers that it did. It copies
 * the bytes into its own buffer, which grows to the largest content seen, so nothing is allocated after warm-up.
 */
export class BitReader {
  #bytes = new Uint8Array(4096);
  #byteCount = 0;
  #bit = 0;

  /** Starts to read these bytes. */
  reset(bytes: Uint8Array): void {
    const room = bytes.length + kBeyondEndBytes;
    if (room > this.#bytes.length) this.#bytes = new Uint8Array(2 * room);
    this.#bytes.set(bytes);
    this.#bytes.fill(0, bytes.length, room);
    this.#byteCount = bytes.length;
    this.#bit = 0;
  }

  /** The next 32 bits, as a signed number; nothing is used up. */
  peek(): number {
    const at = this.#bit >>> 3;
    const used = this.#bit & 7;
    const b = this.#bytes;
    const low = b[at] | (b[at + 1] << 8) | (b[at + 2] << 16) | (b[at + 3] << 24);
    return used === 0 ? low : (low >>> used) | (b[at + 4] << (32 - used));
  }

  skip(count: number): void {
    this.#bit += count;
  }

  /** 0 to 32 bits, as a number from 0 on. */
  take(count: number): number {
    if (count === 0) return 0;
    const bits = this.peek() >>> 0;
    this.#bit += count;
    return count === 32 ? bits : bits & ((1 << count) - 1);
  }

  /** How many zeros come before the next one, at most `most` (0 to 32); nothing is used up. */
  peekZeros(most: number): number {
    const word = this.peek();
    const zeros = word === 0 ? 32 : 31 - Math.clz32(word & -word);
    return zeros < most ? zeros : most;
  }

  isBeyondEnd(): boolean {
    return this.#bit > 8 * this.#byteCount;
  }

  /** True when exactly all bytes were read and the unused bits of the last one are zero. */
  endsHere(): boolean {
    const left = 8 * this.#byteCount - this.#bit;
    if (left < 0 || left >= 8) return false;
    return left === 0 || this.#bytes[this.#byteCount - 1] >> (8 - left) === 0;
  }
}

/** More than is read between two looks at the end: a pose, or a coefficient. */
const kBeyondEndBytes = 512;
