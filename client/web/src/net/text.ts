import { kTextBytesMax } from "../generated/limits";

export { kTextBytesMax };

const decoder = new TextDecoder("utf-8", { fatal: true, ignoreBOM: true });
const encoder = new TextEncoder();
// Unicode's control characters: U+0000 to U+001F and U+007F to U+009F.
const kControl = /\p{Cc}/u;
const kControls = /\p{Cc}/gu;
const kLoneSurrogates = /[\ud800-\udbff](?![\udc00-\udfff])|(?<![\ud800-\udbff])[\udc00-\udfff]/g;

/** The text of these bytes, or null: not UTF-8, with control characters, or too long. */
export function decodeText(bytes: Uint8Array): string | null {
  if (bytes.length > kTextBytesMax) return null;
  try {
    const text = decoder.decode(bytes);
    return kControl.test(text) ? null : text;
  } catch {
    return null;
  }
}

/** Text made fit to travel: what may not becomes "?", what is too long is cut at a whole character. */
export function fitText(text: string): string {
  const plain = text.replace(kControls, "?").replace(kLoneSurrogates, "?");
  if (encoder.encode(plain).length <= kTextBytesMax) return plain;
  let fitted = "";
  let bytes = 0;
  for (const character of plain) {
    bytes += encoder.encode(character).length;
    if (bytes > kTextBytesMax) break;
    fitted += character;
  }
  return fitted;
}
