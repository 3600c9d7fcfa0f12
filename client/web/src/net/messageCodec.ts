import * as flatbuffers from "flatbuffers";
import { HairnetError } from "../hair/hairnetError";
import { LevelIndex } from "../hair/level";
import type * as fb from "./generated/messages";
import { Hash, type Secret, type Vec3 } from "./generated/messages";
import { hashBytes, toHex } from "./groomHash";
import { kMembersPerMessageMax, kTimeMaxNs } from "../generated/limits";
import { decodeText, kTextBytesMax } from "./text";

// How messages are read, written and checked: what an entry of the tables of messages holds, and how the fields are
// treated that several messages have.

export type Builder = flatbuffers.Builder;
export type Offset = flatbuffers.Offset;

/** A message has the name of its table in the schema, but for the case of the first letter. */
export type TableName<M extends { readonly type: string }> = Capitalize<M["type"]> & keyof typeof fb;
export type TableOf<M extends { readonly type: string }> = (typeof fb)[TableName<M>] extends new () => infer Table
  ? Table
  : never;

/** How a message is read from its table. */
export interface MessageReader<M extends { readonly type: string }> {
  /** All but the message's type. Throws `HairnetError` for values that no sender may send. */
  read(from: TableOf<M>): Omit<M, "type">;
}

/** The same of a message that clients send, and how it is written. */
export interface ClientCodec<M extends { readonly type: string }> extends MessageReader<M> {
  write(to: Builder, message: M): Offset;
  /** Throws `HairnetError` for what TypeScript's types let through and a server refuses. */
  check(message: M): void;
  /** The newest is sent again over a new connection: that of the session, or of each character. */
  readonly resent?: "session" | "character";
}

export function invalid(why: string): HairnetError {
  return new HairnetError("invalid", why);
}

// Reading.

const kTimeMax = BigInt(kTimeMaxNs);
/** How strings are read: as bytes, which may be no UTF-8. */
export const kUtf8 = flatbuffers.Encoding.UTF8_BYTES;

export function timeOf(ns: bigint, name: string): number {
  if (ns < -kTimeMax || ns > kTimeMax) throw invalid(`${name}: out of range`);
  return Number(ns);
}

export function textOf(bytes: string | Uint8Array | null, name: string): string {
  if (bytes === null) return "";
  const text = decodeText(bytes as Uint8Array);
  if (text === null) throw invalid(`${name}: not UTF-8 of at most ${kTextBytesMax} bytes free of control characters`);
  return text;
}

export function enumOf(value: number, first: number, last: number, name: string): number {
  if (value < first || value > last) throw invalid(`${name} ${value} does not exist`);
  return value;
}

export const levelOf = (value: number): LevelIndex => enumOf(value, LevelIndex.high, LevelIndex.rigid, "level");

/** The bytes of a struct that has no other meaning. */
function bytesAt(struct: { bb: flatbuffers.ByteBuffer | null; bb_pos: number } | null, count: number): Uint8Array {
  return struct ? struct.bb!.bytes().slice(struct.bb_pos, struct.bb_pos + count) : new Uint8Array(count);
}

export const hashOf = (hash: Hash | null): string => toHex(bytesAt(hash, 32));
export const secretOf = (secret: Secret | null): Uint8Array => bytesAt(secret, 16);

export function vectorOf(vector: Vec3): [number, number, number] {
  return [vector.x(), vector.y(), vector.z()];
}

export function membersOf(members: Uint32Array | null, name: string): number[] {
  if (members!.length > kMembersPerMessageMax) throw invalid(`${name}: more than ${kMembersPerMessageMax} members`);
  return Array.from(members!);
}

// Writing.

export const wholeNs = (ns: number): bigint => BigInt(Math.round(ns));

/** As 64-bit words, which structs of bytes are made of. */
export function words(bytes: Uint8Array): bigint[] {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  return Array.from({ length: bytes.length / 8 }, (_, i) => view.getBigUint64(8 * i, true));
}

export function writeHash(to: Builder, hash: string): Offset {
  const [a, b, c, d] = words(hashBytes(hash));
  return Hash.createHash(to, a, b, c, d);
}

// Checking.

export function checkInteger(value: number, least: number, most: number, name: string): void {
  if (!Number.isInteger(value) || value < least || value > most)
    throw invalid(`${name}: ${value}, not a whole number in [${least}, ${most}]`);
}

export const checkCharacter = (character: number) => checkInteger(character, 1, 0xffffffff, "character");
export const checkLevel = (level: LevelIndex) => checkInteger(level, LevelIndex.high, LevelIndex.rigid, "level");

export function checkMembers(members: readonly number[], name: string): void {
  checkInteger(members.length, 0, kMembersPerMessageMax, name);
  members.forEach(checkMember);
}
export const checkMember = (member: number) => checkInteger(member, 0, 0xffffffff, "member");

export function checkNumbers(values: readonly unknown[], name: string): void {
  if (!values.every(Number.isFinite)) throw invalid(`${name}: not finite numbers`);
}
