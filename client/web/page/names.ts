const kFirst = ["Amber", "Juniper", "Indigo", "Hazel", "Saffron", "Cobalt", "Olive", "Coral", "Sienna", "Teal"];
const kLast = ["Otter", "Finch", "Lynx", "Heron", "Fox", "Wren", "Marten", "Crane", "Hare", "Robin"];
const kKept = "hairnet.name";

/** The name that the user has had here before, or a new one that nobody in the room has. */
export function pickName(taken: ReadonlySet<string>, random: () => number = Math.random): string {
  const kept = keptName();
  if (kept) return kept;
  const names = kFirst.flatMap((first) => kLast.map((last) => `${first} ${last}`)).filter((name) => !taken.has(name));
  return names[Math.floor(random() * names.length)] ?? "Guest";
}

export function keptName(): string {
  try {
    return localStorage.getItem(kKept) ?? "";
  } catch {
    return ""; // storage is switched off
  }
}

export function keepName(name: string): void {
  try {
    localStorage.setItem(kKept, name);
  } catch {
    // The name lasts as long as the page.
  }
}

/** The choice that the fewest wear; the first of them. `worn`: how many wear each. */
export function leastWorn<Choice>(choices: readonly Choice[], worn: (choice: Choice) => number): Choice | null {
  const counts = choices.map(worn);
  return choices[counts.indexOf(Math.min(...counts))] ?? null;
}
