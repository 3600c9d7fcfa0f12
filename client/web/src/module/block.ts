import type { Instance } from "./instance";

/** A part of the module's memory that grows when needed; its contents are lost then. */
export class Block {
  #at = 0;
  #size = 0;

  constructor(private readonly module: Instance) {}

  get at(): number {
    return this.#at;
  }

  /** Makes room for that many bytes, and returns their address. A new block is filled with 0. */
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
