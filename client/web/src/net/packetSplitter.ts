import { kPacketBytesMax, kPacketBytesMin } from "../generated/constants";

/** The size of the number that each packet begins with. */
const kPrefixBytes = 4;

/** Cuts a byte stream into size-prefixed packets (u32, little endian, not counting itself). No I/O. */
export class PacketSplitter {
  /** The first `#filled` bytes are no whole packet yet. The buffer starts small and grows when needed. */
  #buffer = new Uint8Array(1 << 12);
  #filled = 0;
  /** A size was out of bounds, so nothing after it can be understood. */
  #isDead = false;

  /**
   * Calls `onPacket` with each complete packet, prefix included, a copy of its own. Returns false when a prefix is out
   * of bounds: the stream is then unusable. Memory grows with the bytes received, up to one packet and one piece.
   */
  feed(bytes: Uint8Array, onPacket: (packet: Uint8Array) => void): boolean {
    if (this.#isDead) return false;
    this.#append(bytes);
    let at = 0;
    while (this.#filled - at >= kPrefixBytes) {
      const packetBytes = kPrefixBytes + new DataView(this.#buffer.buffer).getUint32(at, true);
      if (packetBytes < kPacketBytesMin || packetBytes > kPacketBytesMax) {
        this.#isDead = true;
        return false;
      }
      if (this.#filled - at < packetBytes) break;
      onPacket(this.#buffer.slice(at, at + packetBytes));
      at += packetBytes;
    }
    this.#buffer.copyWithin(0, at, this.#filled);
    this.#filled -= at;
    return true;
  }

  /** No part of a packet has come after the last whole one. */
  get isBetweenPackets(): boolean {
    return this.#filled === 0;
  }

  #append(bytes: Uint8Array): void {
    const needed = this.#filled + bytes.length;
    if (needed > this.#buffer.length) {
      const larger = new Uint8Array(Math.max(needed, 2 * this.#buffer.length));
      larger.set(this.#buffer.subarray(0, this.#filled));
      this.#buffer = larger;
    }
    this.#buffer.set(bytes, this.#filled);
    this.#filled = needed;
  }
}
