import { expect, it } from "vitest";
import { HairnetError } from "../../src/hair/hairnetError";
import { decodePacket, encodePacket } from "../../src/net/packet";
import type { ClientMessage, Message, ServerMessage } from "../../src/net/messages";
import { serverPacket } from "../support/serverPacket";

// Tags and appearances on the wire: what is refused, whatever the bytes. tests/unit/schema/appearance_test.cpp does the same.

const appearance = { hairRoot: 0x010203, hairTip: 0x040506, skin: 0x070809, roughness: 10 / 255 };
const groom = "ab".repeat(32);

/** A packet with both fields, and where its table has them. */
class Packet {
  bytes: Uint8Array;
  body = 0;
  vtable = 0;
  tagEntry = 0;
  appearanceEntry = 0;
  tagOffset = 0;
  tag = 0;
  appearance = 0;

  constructor({ packet, tagSlot }: Carrier, tagBytes = 8) {
    this.bytes = packet(new Uint8Array(tagBytes).fill(116)).slice();
    const root = 4 + this.u32(4);
    const bodyAt = root + this.u16(this.#vtableOf(root) + 8);
    this.body = bodyAt + this.u32(bodyAt);
    this.vtable = this.#vtableOf(this.body);
    this.tagEntry = this.vtable + tagSlot;
    this.appearanceEntry = this.tagEntry + 2;
    this.tagOffset = this.body + this.u16(this.tagEntry);
    this.tag = this.tagOffset + this.u32(this.tagOffset);
    this.appearance = this.body + this.u16(this.appearanceEntry);
  }
  get #view(): DataView {
    return new DataView(this.bytes.buffer);
  }
  u16 = (at: number) => this.#view.getUint16(at, true);
  u32 = (at: number) => this.#view.getUint32(at, true);
  put16 = (at: number, value: number) => this.#view.setUint16(at, value, true);
  put32 = (at: number, value: number) => this.#view.setUint32(at, value, true);
  cut(size: number): void {
    this.bytes = this.bytes.slice(0, size);
    this.put32(0, size - 4);
  }
  #vtableOf(table: number): number {
    return table - this.#view.getInt32(table, true);
  }
}

interface Carrier {
  readonly name: string;
  /** in the vtable, bytes; the appearance is the next */
  readonly tagSlot: number;
  readonly packet: (tag: Uint8Array) => Uint8Array;
}
const fromClient = (message: ClientMessage) => encodePacket(1, message);
const fromServer = (message: ServerMessage) => serverPacket(1, message);
const carriers: Carrier[] = [
  {
    name: "addCharacter",
    tagSlot: 12,
    packet: (tag) => fromClient({ type: "addCharacter", character: 7, groom, level: 2, state: null, tag, appearance }),
  },
  {
    name: "setAppearance",
    tagSlot: 4,
    packet: (tag) => fromClient({ type: "setAppearance", character: 7, tag, appearance }),
  },
  {
    name: "memberJoined",
    tagSlot: 12,
    packet: (tag) => fromServer({ type: "memberJoined", member: 3, session: 4n, character: 5, groom, tag, appearance }),
  },
  {
    name: "memberChanged",
    tagSlot: 4,
    packet: (tag) => fromServer({ type: "memberChanged", member: 3, tag, appearance }),
  },
];

// 16 for each of the four messages.
const damages: Record<string, (p: Packet) => void> = {
  "a tag one byte longer than the packet": (p) => p.put32(p.tag, p.bytes.length - p.tag - 3),
  "a tag of 4 GB": (p) => p.put32(p.tag, 0xffffffff),
  "a tag of 2 GB": (p) => p.put32(p.tag, 0x80000000),
  "a tag that is its own offset": (p) => p.put32(p.tagOffset, 0),
  "a tag beyond the packet": (p) => p.put32(p.tagOffset, p.bytes.length),
  "a tag at the packet's last byte": (p) => p.put32(p.tagOffset, p.bytes.length - 1 - p.tagOffset),
  "a tag before the packet": (p) => p.put32(p.tagOffset, 0xfffffff0),
  "a tag that is not aligned": (p) => p.put32(p.tagOffset, p.tag - p.tagOffset + 1),
  "a tag's offset beyond the packet": (p) => p.put16(p.tagEntry, 0x7fff),
  "a tag's offset that is not aligned": (p) => p.put16(p.tagEntry, p.tagOffset - p.body + 1),
  "an appearance beyond the packet": (p) => p.put16(p.appearanceEntry, 0x7fff),
  "an appearance that is not whole": (p) => p.put16(p.appearanceEntry, p.bytes.length - p.body - 9),
  "an appearance of one byte": (p) => p.put16(p.appearanceEntry, p.bytes.length - p.body - 1),
  "a table of fields of odd length": (p) => p.put16(p.vtable, p.u16(p.vtable) + 1),
  "a packet that ends in the tag": (p) => p.cut(p.tag + 6),
  "a packet that ends in the appearance": (p) => p.cut(Math.min(p.appearance + 5, p.tag + 3)),
};

function decode(packet: Uint8Array): Message | HairnetError {
  try {
    return decodePacket(packet).message;
  } catch (error) {
    if (error instanceof HairnetError) return error;
    throw error;
  }
}

it("refuses 64 kinds of damaged packets", () => {
  expect(carriers.length * Object.keys(damages).length).toBe(64);
  for (const carrier of carriers) {
    const tag = new Uint8Array(8).fill(116);
    expect(decode(new Packet(carrier).bytes)).toMatchObject({ type: carrier.name, tag, appearance });
    for (const [name, damage] of Object.entries(damages)) {
      const packet = new Packet(carrier);
      damage(packet);
      expect(decode(packet.bytes), `${carrier.name} with ${name}`).toMatchObject({ code: "malformed" });
    }
  }
});

it("takes a tag of at most 256 bytes of any kind", () => {
  const every = Uint8Array.from({ length: 256 }, (_, i) => i);
  for (const { packet } of carriers) expect(decode(packet(every))).toMatchObject({ tag: every, appearance });
  for (const { packet } of carriers.slice(0, 2)) expect(() => packet(new Uint8Array(257))).toThrow(/tag: 257 bytes/);
  for (const { packet } of carriers.slice(2)) {
    const refused = decode(packet(new Uint8Array(257)));
    expect(refused).toMatchObject({ code: "invalid", message: "tag: 257 bytes, more than 256" });
  }
});
