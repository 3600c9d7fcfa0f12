import { expect, it } from "vitest";
import { newBases } from "../../src/net/bases";
import { fromHex, vectors } from "../support/vectors";

it("knows the skin of a groom's body once the groom's basis is here", () => {
  const bytes = fromHex(vectors<{ file: string }>("basis.json").file);
  const bases = newBases();
  expect(bases.of("a groom")).toBeNull();
  bases.announce("a groom", "a basis");
  expect(bases.of("a groom")).toBeNull();
  expect(bases.take({ type: "groomFetched", hash: "a basis", bytes, fault: "" })).toBe("");
  expect(bases.of("a groom")!.skin).toHaveLength(2);
  expect(bases.of("another")).toBeNull();
});
