import type { Instance } from "./instance";

/** A part of the module's memory that grows; what was in it is then lost. */
export class Block {
  #at = 0;
  #size = 0;

  constructor(private readonly module: Instance) {}

  get at(): number {
    return this.#at;
  }

  /** Makes room for that many bytes: 0 where they are new. */
  reserve(byteCount: number): number {
    if (byteCount <= this.#size) return this.#at;
    const size = Math.max(2 * this.#size, byteCount);
    this.free();
    this.#at = this.module.put(new Uint8Array(size));
    this.#size = size;
    return this.#at;
  }

  free(): void {
    this.module.call("free", this.#at);
    this.#at = this.#size = 0;
  }
}
