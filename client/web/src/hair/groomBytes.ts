import { HairnetError } from "../module/hairnetError";

/** The bytes of a .groom file, however they are given. Throws `HairnetError` that says what to give instead. */
export function groomBytes(file: Uint8Array | ArrayBuffer): Uint8Array {
  const bytes = bytesOf(file);
  const text = String.fromCharCode(...bytes.subarray(0, 9)).toLowerCase();
  if (text === "<!doctype" || text.startsWith("<html"))
    throw new HairnetError("malformed", "these bytes are a web page, not a .groom file: is the file at the address?");
  return bytes;
}

function bytesOf(file: unknown): Uint8Array {
  if (file instanceof ArrayBuffer) return new Uint8Array(file);
  if (ArrayBuffer.isView(file)) return new Uint8Array(file.buffer, file.byteOffset, file.byteLength);
  const cure = "give the bytes of a .groom file: await (await fetch(address)).arrayBuffer()";
  throw new HairnetError("invalid", `a groom is a Uint8Array or an ArrayBuffer, not ${nameOf(file)}; ${cure}`);
}

function nameOf(value: unknown): string {
  if (value === null || typeof value !== "object") return typeof value === "string" ? "a text" : String(value);
  return `a ${value.constructor?.name ?? "plain object"}`;
}
