import * as flatbuffers from "flatbuffers";
import { HairnetError } from "../hair/hairnetError";
import { clientCodecs, codecOf, validateMessage, type ClientMessage } from "./clientMessages";
import { layouts } from "./generated/layout";
import * as fb from "./generated/messages";
import { kPacketBytesMax, kTimeMaxNs } from "../generated/limits";
import { invalid, timeOf, wholeNs } from "./messageCodec";
import type { Envelope, Message } from "./messages";
import { serverReaders } from "./serverMessages";
import { verifyBuffer } from "./verify";

interface Reader {
  readonly type: Message["type"];
  readonly table: new () => unknown;
  read(from: unknown): object;
}

function tableName<T extends Message["type"]>(type: T): Capitalize<T> {
  return (type.charAt(0).toUpperCase() + type.slice(1)) as Capitalize<T>;
}

const readers = new Map<fb.Body, Reader>();
for (const [key, reader] of Object.entries({ ...clientCodecs, ...serverReaders })) {
  const type = key as Message["type"];
  const name = tableName(type);
  // biome-ignore lint/performance/noDynamicNamespaceImportAccess: every message needs its table.
  readers.set(fb.Body[name], { type, table: fb[name], read: reader.read } as Reader);
}

/**
 * One size-prefixed packet, ready to send. Text is made fit to travel (`fitText`). Throws `HairnetError` for what may
 * not be sent.
 */
export function encodePacket(clockNs: number, message: ClientMessage): Uint8Array {
  validateMessage(message);
  if (!(Math.abs(clockNs) <= kTimeMaxNs)) throw invalid("clock out of range");
  const to = new flatbuffers.Builder(1024);
  const body = codecOf(message).write(to, message);
  fb.Envelope.startEnvelope(to);
  fb.Envelope.addClockNs(to, wholeNs(clockNs));
  fb.Envelope.addBody(to, body);
  fb.Envelope.addBodyType(to, fb.Body[tableName(message.type)]);
  fb.Envelope.finishSizePrefixedEnvelopeBuffer(to, fb.Envelope.endEnvelope(to));
  const packet = to.asUint8Array();
  checkSize(packet);
  return packet;
}

/**
 * Decodes exactly one packet, size prefix included: verified, its values checked, then copied out; nothing of what is
 * returned lies in `packet`, but the contents of frames may. Throws `HairnetError` and nothing else. Values of poses,
 * materials and winds are not judged here: each is a matter of its own.
 */
export function decodePacket(packet: Uint8Array): Envelope {
  checkSize(packet);
  // Vectors of numbers are read where they lie.
  const aligned = packet.byteOffset % 8 === 0 ? packet : packet.slice();
  verifyBuffer(aligned, "HNET", "Envelope", layouts);
  const root = fb.Envelope.getSizePrefixedRootAsEnvelope(new flatbuffers.ByteBuffer(aligned));
  const clockNs = timeOf(root.clockNs(), "envelope's clock");
  const reader = readers.get(root.bodyType());
  if (!reader) throw invalid("no message of a kind that this version knows");
  const content = reader.read(root.body(new reader.table()));
  return { clockNs, message: { type: reader.type, ...content } as Message };
}

function checkSize(packet: Uint8Array): void {
  if (packet.length > kPacketBytesMax)
    throw new HairnetError("too_large", `packet of ${packet.length} bytes, more than ${kPacketBytesMax}`);
}
