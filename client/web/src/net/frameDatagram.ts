import { HairnetError } from "../hair/hairnetError";
import { kDatagramBytesMax } from "../generated/limits";
import { decodeFrames } from "./frameBatch";
import { timeOf } from "./messageCodec";
import type { Envelope } from "./messages";

// A FrameBatch in a datagram without an envelope around it (schema/PROTOCOL.md, WebTransport).

/** Its number, for `Hello.datagramLayout`. */
export const kFrameDatagramLayout = 1;

const kMark = [0x46, 0x42]; // "FB"
const kSampleTimeAt = 2;
const kClockAt = 10;
const kTickAt = 15;
const kTickBitsMax = 64n;

/** Whether bytes are of this layout; no packet is. */
export function isFrameDatagram(bytes: Uint8Array): boolean {
  return bytes.length <= kDatagramBytesMax && kMark.every((byte, i) => bytes[i] === byte);
}

/**
 * Decodes bytes of this layout. Values are checked and copied out, but contents of frames lie in `bytes`. Throws
 * `HairnetError` and nothing else.
 */
export function decodeFrameDatagram(bytes: Uint8Array): Envelope {
  if (bytes.length <= kTickAt) throw endsEarly();
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const sampleNs = view.getBigInt64(kSampleTimeAt, true);
  const sampleTimeNs = timeOf(sampleNs, "frames' sample time");
  const sinceSampleNs = view.getUint32(kClockAt, true) + 2 ** 32 * view.getInt8(kClockAt + 4);
  const clockNs = timeOf(sampleNs + BigInt(sinceSampleNs), "frame datagram's clock");
  const [tick, framesAt] = tickOf(bytes);
  const generations: number[] = [];
  const frames = decodeFrames(bytes.subarray(framesAt), generations);
  if (frames.length === 0) throw new HairnetError("invalid", "frame batch: no frame");
  const message = {
    type: "frameBatch",
    tick,
    sampleTimeNs,
    frames,
    generations: Uint8Array.from(generations),
  } as const;
  return { clockNs, message };
}

/** The tick, and where the frames begin. */
function tickOf(bytes: Uint8Array): [number, number] {
  let tick = 0n;
  for (let at = kTickAt, shift = 0n; at < bytes.length && shift < kTickBitsMax; ++at, shift += 7n) {
    tick |= BigInt(bytes[at] & 0x7f) << shift;
    if (bytes[at] & 0x80) continue;
    if (tick >> kTickBitsMax) break;
    return [Number(tick), at + 1];
  }
  throw endsEarly();
}

const endsEarly = () => new HairnetError("malformed", "frame datagram: ends within its head");
