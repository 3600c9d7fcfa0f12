import { HairnetError } from "../module/hairnetError";

/**
 * Throws `HairnetError` unless `options` is an object whose properties are all in `known`: a misspelt option would
 * otherwise be ignored. `of` names the call in the message.
 */
export function checkOptions<T extends object>(
  options: T,
  known: Readonly<Record<keyof T, unknown>>,
  of: string,
): void {
  if (typeof options !== "object" || options === null || Array.isArray(options))
    throw new HairnetError("invalid", `${of}: options are an object like { ${Object.keys(known)[0]}: ... }`);
  for (const name of Object.keys(options)) {
    if (Object.hasOwn(known, name)) continue;
    const likely = nearest(name, Object.keys(known));
    const cure = likely ? `did you mean '${likely}'?` : `there are ${Object.keys(known).join(", ")}`;
    throw new HairnetError("unknown_option", `${of}: there is no option '${name}'; ${cure}`);
  }
}

// The known name that differs from `name` by at most a third of its letters; null: none is so near.
function nearest(name: string, names: readonly string[]): string | null {
  const near = (each: string) => distance(name.toLowerCase(), each.toLowerCase());
  const [best] = [...names].sort((a, b) => near(a) - near(b));
  return best !== undefined && near(best) <= Math.ceil(best.length / 3) ? best : null;
}

// Levenshtein's distance: how many letters must be changed, added or left out to make one text of the other. `row` has
// the distances of the first i letters of `a` from all beginnings of `b`.
function distance(a: string, b: string): number {
  let row = Array.from({ length: b.length + 1 }, (_, j) => j);
  for (let i = 1; i <= a.length; ++i) {
    const next = [i];
    for (let j = 1; j <= b.length; ++j)
      next.push(Math.min(row[j] + 1, next[j - 1] + 1, row[j - 1] + (a[i - 1] === b[j - 1] ? 0 : 1)));
    row = next;
  }
  return row[b.length];
}
