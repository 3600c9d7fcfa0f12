import { expect, test } from "vitest";
import { leastUsed, pickName } from "../../page/names";

test("a picked name is nobody's in the room, for any choice of chance", () => {
  const taken = new Set<string>();
  for (let n = 0; n < 100; ++n) {
    // The factor makes a sequence of numbers from 0 to 1 that stand for chance.
    const name = pickName(taken, () => (n * 0.37) % 1);
    expect(taken.has(name)).toBe(false);
    taken.add(name);
  }
  expect(pickName(taken)).toBe("Guest");
});

test("the hairstyle that the fewest have is picked, the first of them", () => {
  const used: Record<string, number> = { bob: 2, curls: 1, plait: 1 };
  expect(leastUsed(Object.keys(used), (style) => used[style])).toBe("curls");
  expect(leastUsed([], () => 0)).toBeNull();
});
