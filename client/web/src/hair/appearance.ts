import { HairnetError } from "../module/hairnetError";

/** How a character is drawn. Colours are sRGB, 0xrrggbb. */
export interface Appearance {
  readonly hairRoot: number;
  readonly hairTip: number;
  readonly skin: number;
  /** The roughness of the hair, 0 (smooth, sharp highlights) to 1. */
  readonly roughness: number;
}

/** The hair of characters without an appearance, in the order of their numbers: neighbours have different colours. */
const kHairColours: readonly number[] = [
  0x694830, // brown
  0xbfa273, // blonde
  0x29231f, // black
  0x9e5930, // red
  0x957955, // dark blonde
  0x453022, // dark brown
  0x7c422c, // auburn
  0xadadaf, // grey
];
/** The default colour of the skin. */
const kSkin = 0xe1bfad;
/** The default roughness, about 0.3. It travels as a byte, so it is a whole number of 255ths. */
export const kRoughness = 77 / 255;

/** The names of all fields, for the check of what a program gives. */
const kFields: readonly string[] = ["hairRoot", "hairTip", "skin", "roughness"];

/** What a character without an appearance is drawn like, by its number (from 1): the same everywhere. */
export function defaultAppearance(number: number): Appearance {
  const hair = kHairColours[(number + kHairColours.length - 1) % kHairColours.length];
  return { hairRoot: hair, hairTip: hair, skin: kSkin, roughness: kRoughness };
}

/**
 * `base` with the given changes; a `hairRoot` without a `hairTip` colours the whole hair. Throws `HairnetError` unless
 * all are valid.
 */
export function changedAppearance(base: Appearance, changes: Partial<Appearance>): Appearance {
  if (typeof changes !== "object" || changes === null || Array.isArray(changes))
    throw error(`is not an object such as { hairRoot: 0x9e5930 }`);
  for (const name of Object.keys(changes)) {
    if (!kFields.includes(name)) throw error(`has no ${JSON.stringify(name)}; it has ${kFields.join(", ")}`);
  }
  const given: Partial<Appearance> = Object.fromEntries(
    Object.entries(changes).filter(([, value]) => value !== undefined),
  );
  const whole = "hairRoot" in given ? { hairTip: given.hairRoot } : {};
  const changed = { ...base, ...whole, ...given } as Appearance;
  checkAppearance(changed);
  // Roughness travels as a byte, so everyone, the owner included, draws with the rounded one.
  return { ...changed, roughness: Math.round(255 * changed.roughness) / 255 };
}

export function isSameAppearance(a: Appearance | null, b: Appearance | null): boolean {
  if (!a || !b) return a === b;
  return a.hairRoot === b.hairRoot && a.hairTip === b.hairTip && a.skin === b.skin && a.roughness === b.roughness;
}

/** Throws `HairnetError` unless every field is there and in its range. */
export function checkAppearance({ hairRoot, hairTip, skin, roughness }: Appearance): void {
  for (const [name, colour] of Object.entries({ hairRoot, hairTip, skin })) {
    if (!Number.isInteger(colour) || colour < 0 || colour > 0xffffff)
      throw error(`${name} is ${shown(colour)}; a colour is a whole number from 0x000000 to 0xffffff`);
  }
  if (!(typeof roughness === "number" && roughness >= 0 && roughness <= 1))
    throw error(`roughness is ${shown(roughness)}; it is a number from 0 to 1`);
}

function error(what: string): HairnetError {
  return new HairnetError("invalid", `appearance: ${what}`);
}

/** A value of any type, short enough for an error's line. */
function shown(value: unknown): string {
  return typeof value === "string"
    ? JSON.stringify(value.slice(0, 40))
    : typeof value === "object"
      ? "an object"
      : String(value);
}
