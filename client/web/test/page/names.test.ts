import { expect, test } from "vitest";
import { pickName } from "../../page/names";

test("a picked name is nobody's in the room, for any choice of chance", () => {
  // There are 100 names: ten first ones, each with ten last ones.
  const taken = new Set<string>();
  for (let n = 0; n < 100; ++n) {
    // The factor makes a sequence of numbers from 0 to 1 that stand for chance.
    const name = pickName(taken, () => (n * 0.37) % 1);
    expect(taken.has(name)).toBe(false);
    taken.add(name);
  }
  // Every name is taken by now.
  expect(pickName(taken)).toBe("Guest");
});
