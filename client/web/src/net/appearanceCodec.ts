import type { Appearance } from "../hair/appearance";
import * as fb from "./generated/messages";
import { kTagBytesMax } from "../generated/limits";
import { invalid, type Builder, type Offset } from "./messageCodec";

// How tags and appearances of characters are read, written and checked.

export function checkTag(tag: Uint8Array): void {
  if (!(tag instanceof Uint8Array)) throw invalid("tag: neither text nor a Uint8Array");
  if (tag.length > kTagBytesMax) throw invalid(`tag: ${tag.length} bytes, more than ${kTagBytesMax}`);
}

/** The bytes of a tag, copied; text as UTF-8. Throws `HairnetError` when it is no tag. */
export function tagBytes(tag: Uint8Array | string): Uint8Array {
  if (typeof tag === "string" && /\p{Surrogate}/u.test(tag)) throw invalid("tag: text with half a character");
  const bytes = typeof tag === "string" ? new TextEncoder().encode(tag) : tag;
  checkTag(bytes);
  return bytes.slice();
}

export function tagOf(bytes: Uint8Array | null): Uint8Array {
  const tag = bytes ?? new Uint8Array();
  checkTag(tag);
  return tag.slice();
}

/** 0: no tag. */
export function writeTag(to: Builder, tag: Uint8Array): Offset {
  return tag.length === 0 ? 0 : to.createByteVector(tag);
}

export function appearanceOf(from: fb.Appearance | null): Appearance | null {
  if (!from) return null;
  const colour = (c: fb.Srgb) => (c.red() << 16) | (c.green() << 8) | c.blue();
  return {
    hairRoot: colour(from.hairRoot()!),
    hairTip: colour(from.hairTip()!),
    skin: colour(from.skin()!),
    roughness: from.roughness() / 255,
  };
}

/** Must be written where the table is. */
export function writeAppearance(to: Builder, { hairRoot, hairTip, skin, roughness }: Appearance): Offset {
  const bytes = (colour: number) => [colour >> 16, (colour >> 8) & 0xff, colour & 0xff] as const;
  const [root, tip, body] = [bytes(hairRoot), bytes(hairTip), bytes(skin)];
  return fb.Appearance.createAppearance(to, ...root, ...tip, ...body, Math.round(255 * roughness));
}
