import { expect, test } from "vitest";
import { foreignFileWords, refusedWords } from "../../page/errorWords";
import { isolated } from "../../page/isolated";
import { hairstyleName, personName } from "../../page/roomDetails";

// Control characters of Unicode that change the direction of the text after them. kOverride writes all letters from
// right to left.
const kOverride = "\u202e";
const kEmbeddings = ["\u202a", "\u202b", "\u202d", kOverride, "\u2066", "\u2067", "\u2068", "\u2069"];

/** The text with what is isolated left out; every isolate must end, and nothing outside of one may direct. */
function outside(text: string): string {
  const left = text.replaceAll(/\u2068[^\u2066-\u2069]*\u2069/g, "NAME");
  for (const character of kEmbeddings) expect(left).not.toContain(character);
  return left;
}
const person = (tagText: string) => personName({ tagText, groom: null, member: 4, own: true });

// A person may choose a name that turns the page's own words around, so that they say something else.
test("a name turns nothing around it round, whatever directs inside it", () => {
  // After the names with one control character come a Hebrew name, and two that end an isolate which they did not
  // begin.
  for (const name of [
    ...kEmbeddings.map((one) => `An${one}n`),
    "\u05d3\u05d5\u05d3",
    `${kOverride}\u2069ym`,
    "\u2069\u2069a\u2068",
  ])
    expect(outside(person(name)), JSON.stringify(name)).toBe("NAME (you)");
});

test("a name that goes the page's way is as it is, and one of nothing but directions is none", () => {
  for (const name of ["Ann", "Zo\u00eb \u{1f469}\u200d\u{1f9b1}", "\u6797 3"])
    expect(person(name)).toBe(`${name} (you)`);
  expect(person("\u202e\u2069")).toBe("Hairstyle 4 (you)");
  expect(isolated("")).toBe("");
});

test("so it is with hairstyles, files and what a moderator writes", () => {
  expect(outside(`${hairstyleName(`a${kOverride}b`)} (in the room)`)).toBe("NAME (in the room)");
  // This name looks as if it ended in ".hair": the override turns its letters around.
  const scene = `a${kOverride}riah.fbx`;
  expect(outside(foreignFileWords([scene], `${scene}: strands are read from …`))).toMatch(
    /^The page does not read NAME: /,
  );
  expect(outside(foreignFileWords(["a.hair"], `a${kOverride}riah.hair: not a .hair file`))).toBe("NAME");
  expect(outside(refusedWords(`the server says goodbye: removed: ${kOverride}spam`, true))).toBe("NAME.");
});
