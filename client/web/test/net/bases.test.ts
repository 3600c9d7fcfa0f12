import { expect, it } from "vitest";
import { Bases } from "../../src/net/bases";
import { fromHex, vectors } from "../support/vectors";

it("knows the skin of a groom's body once the groom's basis is here", () => {
  const bytes = fromHex(vectors<{ file: string }>("basis.json").file);
  const bases = new Bases();
  expect(bases.skinOf("a groom")).toBeNull();
  bases.announce({ type: "groomBasis", groom: "a groom", basis: "a basis" });
  expect(bases.skinOf("a groom")).toBeNull();
  expect(bases.take({ type: "groomFetched", hash: "a basis", bytes, fault: "" })).toBe("");
  expect(bases.skinOf("a groom")).toHaveLength(2);
  expect(bases.skinOf("another")).toBeNull();
});
