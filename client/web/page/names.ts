import { keep, kept } from "./kept";

const kFirst = ["Amber", "Juniper", "Indigo", "Hazel", "Saffron", "Cobalt", "Olive", "Coral", "Sienna", "Teal"];
const kLast = ["Otter", "Finch", "Lynx", "Heron", "Fox", "Wren", "Marten", "Crane", "Hare", "Robin"];
/** The key of the user's name in the browser's storage. */
const kKey = "hairnet.name";

/** The name that the user has had here before, or a new one that nobody in the room has. */
export function pickName(taken: ReadonlySet<string>, random: () => number = Math.random): string {
  const before = keptName();
  if (before) return before;
  const names = kFirst.flatMap((first) => kLast.map((last) => `${first} ${last}`)).filter((name) => !taken.has(name));
  return names[Math.floor(random() * names.length)] ?? "Guest";
}

export function keptName(): string {
  return kept(kKey);
}

export function keepName(name: string): void {
  keep(kKey, name);
}
