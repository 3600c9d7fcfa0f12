import { expect, test } from "vitest";
import { leastUsed } from "../../page/hairstylePicker";

test("the hairstyle that the fewest have is picked, the first of them", () => {
  const used: Record<string, number> = { bob: 2, curls: 1, plait: 1 };
  expect(leastUsed(Object.keys(used), (style) => used[style])).toBe("curls");
  // Without a hairstyle there is none to pick.
  expect(leastUsed([], () => 0)).toBeNull();
});
