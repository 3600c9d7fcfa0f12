import { describe, expect, it } from "vitest";
import { PacketSplitter } from "../../src/net/packetSplitter";

/** A packet of that size: its size without the first four bytes, then `fill`. */
function packet(bytes: number, fill: number): Uint8Array {
  const made = new Uint8Array(bytes).fill(fill);
  new DataView(made.buffer).setUint32(0, bytes - 4, true);
  return made;
}

describe("packet splitter", () => {
  it("gives the same packets however the bytes arrive", () => {
    const packets = [packet(16, 1), packet(5000, 2), packet(16, 3), packet(20_000, 4)];
    const stream = Uint8Array.from(packets.flatMap((each) => [...each]));
    // Pieces may cut a size in the middle, end with a packet, or hold several packets.
    for (const piece of [1, 3, 16, 999, 4096, stream.length]) {
      const splitter = new PacketSplitter();
      const found: Uint8Array[] = [];
      for (let at = 0; at < stream.length; at += piece)
        expect(splitter.feed(stream.subarray(at, at + piece), (each) => found.push(each))).toBe(true);
      expect(found).toEqual(packets);
    }
  });

  it("ends at a size that no packet has, and stays ended", () => {
    // The field counts the bytes after itself. With its 4 bytes the sizes are 4 and 15, below the smallest packet of 16
    // (kPacketBytesMin), or above the largest of 4 MiB (kPacketBytesMax).
    for (const size of [0, 11, 4_194_304, 0xffffffff]) {
      const splitter = new PacketSplitter();
      const bytes = packet(16, 0);
      new DataView(bytes.buffer).setUint32(0, size, true);
      expect(splitter.feed(bytes, () => expect.unreachable())).toBe(false);
      expect(splitter.feed(packet(16, 1), () => expect.unreachable())).toBe(false);
    }
  });
});
