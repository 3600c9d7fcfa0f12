import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { describe, expect, it } from "vitest";
import { HairnetError } from "../../src/hair/hairnetError";
import { clientCodecs } from "../../src/net/clientMessages";
import { decodeFrameDatagram, isFrameDatagram } from "../../src/net/frameDatagram";
import { toHex } from "../../src/net/groomHash";
import type { ClientMessage, Envelope, Message, PoseBatch, PoseSample } from "../../src/net/messages";
import { decodePacket, encodePacket } from "../../src/net/packet";
import { kObserveAll } from "../../src/net/roomMessages";
import { serverReaders } from "../../src/net/serverMessages";
import { fromEarlier } from "../support/fromEarlier";
import { fromHex, seeded, vectorFolder, vectors } from "../support/vectors";

interface FrameDatagramVector {
  packet: string;
  error: string;
  clockNs: string;
  message: Record<string, unknown>;
}

interface PacketVector {
  /** its numbers are exact in doubles, and a client may send it */
  tame: boolean;
  packet: string;
  clockNs: string;
  message: Record<string, unknown>;
}

const cases = vectors<PacketVector[]>("packets.json");

const kClientTypes = new Set(Object.keys(clientCodecs));
// 64-bit numbers that are numbers here: text in the vectors.
const kWide = new Set([
  "clockNs",
  "captureTimeNs",
  "sampleTimeNs",
  "poseDelayNs",
  "tick",
  "offset",
  "byteCount",
  "groomBytesMax",
]);

/** Like the vectors, but with wide numbers rounded on both sides. */
function plain(key: string, value: unknown): unknown {
  if (kWide.has(key)) return Number(value);
  if (typeof value === "bigint") return value.toString();
  if (key === "tag" && value instanceof Uint8Array) return new TextDecoder().decode(value);
  if (value instanceof Uint8Array) return toHex(value);
  if (ArrayBuffer.isView(value)) return Array.from(value as Float32Array);
  return value;
}
const asJson = (message: unknown): unknown => JSON.parse(JSON.stringify(message, plain));

/** Returns the thrown error, which must be this package's own with one line, or the decoded envelope. */
function attempt(packet: Uint8Array, decode = decodePacket): Envelope | HairnetError {
  try {
    return decode(packet);
  } catch (error) {
    if (!(error instanceof HairnetError)) throw error;
    expect(error.message).not.toMatch(/\n/);
    return error;
  }
}

describe("packets of the C++ library", () => {
  it("has every message of the protocol among its vectors", () => {
    const types = [...Object.keys(clientCodecs), ...Object.keys(serverReaders)];
    expect(new Set(cases.map((each) => each.message.type))).toEqual(new Set(types));
  });

  it("reads each as it was meant", () => {
    for (const each of cases) {
      const { clockNs, message } = decodePacket(fromHex(each.packet));
      expect(clockNs).toBe(Number(each.clockNs));
      expect(asJson(message)).toEqual(asJson(each.message));
    }
  });

  it("reads a packet that does not lie at an aligned address", () => {
    for (const each of cases.slice(0, 60)) {
      const bytes = fromHex(each.packet);
      const shifted = new Uint8Array(bytes.length + 3);
      shifted.set(bytes, 3);
      expect(asJson(decodePacket(shifted.subarray(3)).message)).toEqual(asJson(each.message));
    }
  });

  it("writes what a client says so that it reads the same again, and leaves it for C++ to read", () => {
    const encoded = cases
      .filter((each) => each.tame && kClientTypes.has(each.message.type as string))
      .map((each) => {
        const { clockNs, message } = decodePacket(fromHex(each.packet));
        const packet = encodePacket(clockNs, message as ClientMessage);
        const again = decodePacket(packet);
        expect(again.clockNs).toBe(clockNs);
        expect(asJson(again.message)).toEqual(asJson(each.message));
        return { packet: toHex(packet), clockNs: each.clockNs, message: each.message };
      });
    expect(new Set(encoded.map((each) => each.message.type)).size).toBe(kClientTypes.size);
    writeFileSync(join(vectorFolder, "from_web.json"), JSON.stringify(encoded));
  });

  it("leaves what it has decoded as it is when the packet's bytes change, but for frames' contents", () => {
    for (const each of cases) {
      if (each.message.type === "frameBatch") continue;
      const packet = fromHex(each.packet);
      const { message } = decodePacket(packet);
      packet.fill(0xff);
      expect(asJson(message)).toEqual(asJson(each.message));
    }
  });
});

describe("earlier poses", () => {
  it("are read as C++ reads them, and written so that they are read again", () => {
    const read = vectors<{ packet: string; earlier: PoseSample[] }[]>("earlier_poses.json");
    expect(read.length).toBeGreaterThan(50);
    for (const { packet, earlier } of read) {
      const batch = decodePacket(fromHex(packet)).message as PoseBatch;
      expect(decodePacket(encodePacket(0, batch)).message).toEqual(batch);
      const ours = fromEarlier(batch.earlier![0], batch.poses[0]);
      expect(ours).toMatchObject({ character: earlier[0].character, sequence: earlier[0].sequence });
      expect(ours.captureTimeNs).toBe(Number(earlier[0].captureTimeNs));
      for (const [i, number] of ours.pose.entries())
        expect(Math.abs(number - earlier[0].pose[i])).toBeLessThanOrEqual(2e-7 * Math.max(Math.abs(number), 1));
    }
  });
});

describe("frame datagrams", () => {
  const datagrams = vectors<FrameDatagramVector[]>("frame_datagrams.json");
  const sound = datagrams.filter((each) => each.error === "none");

  it("reads those that C++ reads as it does, and refuses those that it refuses", () => {
    for (const each of datagrams) {
      const bytes = fromHex(each.packet);
      expect(isFrameDatagram(bytes)).toBe(true);
      const got = attempt(bytes, decodeFrameDatagram);
      if (each.error !== "none") {
        expect(got).toMatchObject({ code: each.error });
        continue;
      }
      expect((got as Envelope).clockNs).toBe(Number(each.clockNs));
      expect(asJson((got as Envelope).message)).toEqual(asJson(each.message));
    }
    expect(sound.length).toBeGreaterThan(300);
    expect(datagrams.length - sound.length).toBeGreaterThan(300);
  });

  it("are no packets, nor packets they", () => {
    for (const each of sound) expect(attempt(fromHex(each.packet))).toBeInstanceOf(HairnetError);
    for (const each of cases) expect(isFrameDatagram(fromHex(each.packet))).toBe(false);
    expect(isFrameDatagram(new Uint8Array())).toBe(false);
    const large = new Uint8Array(1025);
    large.set([0x46, 0x42]);
    expect(isFrameDatagram(large)).toBe(false);
  });

  it("gives frames or its own error at every truncation, wherever the bytes lie", () => {
    for (const each of sound.slice(0, 50)) {
      const bytes = fromHex(each.packet);
      const shifted = new Uint8Array(bytes.length + 3);
      shifted.set(bytes, 3);
      for (let length = 2; length <= bytes.length; ++length) {
        const got = attempt(shifted.subarray(3, 3 + length), decodeFrameDatagram);
        if (!(got instanceof HairnetError)) expect(got.message).toMatchObject({ tick: Number(each.message.tick) });
      }
    }
  });
});

describe("spoilt packets", () => {
  it("reads those that C++ reads and refuses those that it refuses", () => {
    const spoilt = vectors<{ packet: string; error: string }[]>("spoilt.json");
    const differ = spoilt.filter(
      (each) => attempt(fromHex(each.packet)) instanceof HairnetError !== (each.error !== "none"),
    );
    expect(differ).toEqual([]);
    expect(spoilt.filter((each) => each.error === "none").length).toBeGreaterThan(500);
    expect(spoilt.filter((each) => each.error !== "none").length).toBeGreaterThan(500);
  });

  it("refuses every truncation", () => {
    for (let i = 0; i < cases.length; i += 5) {
      const packet = fromHex(cases[i].packet);
      for (let length = 0; length < Math.min(packet.length, 600); ++length)
        expect(attempt(packet.slice(0, length))).toBeInstanceOf(HairnetError);
    }
  });

  it("refuses every truncation whose length field agrees, or reads it", () => {
    for (let i = 0; i < cases.length; i += 12) {
      const packet = fromHex(cases[i].packet);
      for (let length = 4; length < Math.min(packet.length, 600); ++length) {
        const cut = packet.slice(0, length);
        new DataView(cut.buffer).setUint32(0, length - 4, true);
        attempt(cut);
      }
    }
  });

  it("refuses extra bytes", () => {
    for (const each of cases) {
      const packet = fromHex(each.packet);
      const longer = new Uint8Array(packet.length + 1);
      longer.set(packet);
      expect(attempt(longer)).toBeInstanceOf(HairnetError);
    }
  });

  it("neither hangs nor throws anything but its own error at 20 000 mutations", () => {
    const random = seeded(42);
    const below = (count: number) => Math.floor(random() * count);
    const packets = cases.map((each) => fromHex(each.packet));
    let refused = 0;
    for (let n = 0; n < 20_000; ++n) {
      const packet = packets[below(packets.length)].slice();
      const view = new DataView(packet.buffer);
      for (let changes = 1 + below(4); changes > 0; --changes) {
        const at = below(packet.length);
        const kind = below(4);
        if (kind === 0) packet[at] ^= 1 << below(8);
        else if (kind === 1) packet[at] = below(256);
        else if (kind === 2 && at + 4 <= packet.length)
          view.setUint32(at, [0, 1, 0x7fffffff, 0xffffffff][below(4)], true);
        else if (at + 2 <= packet.length) view.setUint16(at, [0, 0x7fff, 0x8000, 0xffff][below(4)], true);
      }
      const result = attempt(packet);
      if (result instanceof HairnetError) ++refused;
      else JSON.stringify(result.message, plain);
    }
    expect(refused).toBeGreaterThan(2_000);
    expect(refused).toBeLessThan(20_000);
  });

  it("refuses random bytes behind a sound beginning", () => {
    const random = seeded(7);
    for (let n = 0; n < 5_000; ++n) {
      const packet = Uint8Array.from({ length: 16 + Math.floor(random() * 200) }, () => Math.floor(random() * 256));
      const view = new DataView(packet.buffer);
      view.setUint32(0, packet.length - 4, true);
      view.setUint32(4, 4 * Math.floor(random() * 30), true);
      packet.set([0x48, 0x4e, 0x45, 0x54], 8);
      attempt(packet);
    }
  });

  it("says of a packet that is too long that it is", () => {
    const result = attempt(new Uint8Array((4 << 20) + 1));
    expect(result).toBeInstanceOf(HairnetError);
    expect((result as HairnetError).code).toBe("too_large");
  });
});

describe("what a client may not say", () => {
  const groom = "00".repeat(32);
  const wrong: [string, unknown][] = [
    ["a character that is 0", { type: "setLevel", character: 0, level: 0 }],
    ["a character that is no whole number", { type: "removeCharacter", character: 1.5 }],
    ["a level that does not exist", { type: "setLevel", character: 1, level: 6 }],
    ["a hash of the wrong length", { type: "groomRequest", hash: "abc", offset: 0 }],
    ["an offer of no bytes", { type: "groomOffer", hash: groom, byteCount: 0 }],
    ["a chunk that is too large", { type: "groomChunk", hash: groom, offset: 0, bytes: new Uint8Array(262145) }],
    [
      "a pose that is not finite",
      {
        type: "poseBatch",
        poses: [{ character: 1, sequence: 0, captureTimeNs: 0, teleport: false, pose: new Float64Array(35).fill(NaN) }],
      },
    ],
    [
      "a rotation that is not of unit length",
      {
        type: "poseBatch",
        poses: [{ character: 1, sequence: 0, captureTimeNs: 0, teleport: false, pose: new Float64Array(35) }],
      },
    ],
    [
      "a material that is not finite",
      {
        type: "setMaterial",
        character: 1,
        scale: { stiffness: Infinity, damping: 1, density: 1, etherDamping: 1, airDrag: 1, gelPerS2: 0 },
      },
    ],
    ["a stride of 3", { ...kObserveAll, stride: 3 }],
    ["a screen height below 0", { type: "reportImportance", members: [{ member: 1, screenHeight: -1, inView: true }] }],
  ];
  for (const [what, message] of wrong) {
    it(`refuses ${what}`, () => {
      expect(() => encodePacket(0, message as ClientMessage)).toThrow(HairnetError);
    });
  }

  it("makes text fit to travel", () => {
    const detail = `a\u0000b\ud800c${"\u{1f487}".repeat(400)}`;
    const packet = encodePacket(0, { type: "goodbye", reason: 1, detail });
    const message = decodePacket(packet).message as Message & { type: "goodbye" };
    expect(message.detail.startsWith("a?b?c\u{1f487}")).toBe(true);
    expect(new TextEncoder().encode(message.detail).length).toBeLessThanOrEqual(1024);
  });
});
