import { blake2b } from "@noble/hashes/blake2.js";
import { HairnetError } from "../hair/hairnetError";

/** BLAKE2b-256 of a groom's file, as 64 lower-case hexadecimal digits. */
export type GroomHash = string;

const kHashBytes = 32;
const kHex = Array.from({ length: 256 }, (_, byte) => byte.toString(16).padStart(2, "0"));

export function hashGroom(file: Uint8Array): GroomHash {
  return toHex(blake2b(file, { dkLen: kHashBytes }));
}

export function toHex(bytes: Uint8Array): string {
  let hex = "";
  for (const byte of bytes) hex += kHex[byte];
  return hex;
}

/** Throws `HairnetError` unless it is one. */
export function hashBytes(hash: GroomHash): Uint8Array {
  if (!/^[0-9a-f]{64}$/.test(hash)) throw new HairnetError("invalid", "a groom's hash is not 64 hexadecimal digits");
  return Uint8Array.from({ length: kHashBytes }, (_, i) => parseInt(hash.slice(2 * i, 2 * i + 2), 16));
}
