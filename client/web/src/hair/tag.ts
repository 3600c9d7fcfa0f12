import { kTagBytesMax } from "../generated/constants";
import { HairnetError } from "../module/hairnetError";

const decoder = new TextDecoder("utf-8", { fatal: true, ignoreBOM: true });
// Unicode's control characters: U+0000 to U+001F and U+007F to U+009F.
const kControl = /\p{Cc}/u;

/** The bytes of a tag: a copy, or text as UTF-8. Throws `HairnetError` for a value that is no tag. */
export function tagBytes(tag: Uint8Array | string): Uint8Array {
  if (typeof tag === "string" && /\p{Surrogate}/u.test(tag)) throw error("text with half a character");
  const bytes: unknown = typeof tag === "string" ? new TextEncoder().encode(tag) : tag;
  if (!(bytes instanceof Uint8Array)) throw error("neither text nor a Uint8Array");
  if (bytes.length > kTagBytesMax) throw error(`${bytes.length} bytes, more than ${kTagBytesMax}`);
  return bytes.slice();
}

/** The text of a tag; "" if it is no UTF-8 or has control characters. */
export function tagText(tag: Uint8Array): string {
  try {
    const text = decoder.decode(tag);
    return kControl.test(text) ? "" : text;
  } catch {
    return "";
  }
}

function error(what: string): HairnetError {
  return new HairnetError("invalid", `tag: ${what}`);
}
