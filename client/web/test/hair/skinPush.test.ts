import { describe, expect, it } from "vitest";
import { HairnetError } from "../../src/hair/hairnetError";
import { rigidPose } from "../../src/hair/pose";
import { skinFault, type Skin } from "../../src/hair/skin";
import { SkinPush } from "../../src/hair/skinPush";
import { furthest } from "../support/vectors";
import { skinVector } from "../support/skinVector";

const { skin, thicknessM, pose, rest, blend, points, pushed, nodes } = skinVector();

describe("the push out of the skin", () => {
  it("is that of C++", () => {
    const push = new SkinPush(skin, thicknessM);
    expect(push.nodes).toEqual(nodes);
    const out = points.slice();
    push.push(pose, rest, blend, out);
    expect(furthest(out, pushed)).toBeLessThan(1e-6);
    expect(furthest(out, points)).toBeGreaterThan(0.02);
  });

  it("leaves hair at rest as it is, and all hair where no skin is known", () => {
    const still = rest.slice();
    new SkinPush(skin, thicknessM).push(rigidPose([0, 0.6, 0, 0.8], [5, 1, -400]), rest, blend, still);
    expect(still).toEqual(rest);
    const out = points.slice();
    new SkinPush([], thicknessM).push(pose, rest, null, out);
    expect(out).toEqual(points);
  });

  it("refuses lists of different lengths", () => {
    const push = new SkinPush(skin, thicknessM);
    expect(() => push.push(pose, rest.slice(3), null, points.slice())).toThrow(HairnetError);
    expect(() => push.push(pose, rest, blend.slice(1), points.slice())).toThrow(HairnetError);
  });
});

describe("a skin", () => {
  it.each([
    ["two fields of a bone", { bone: skin[1].bone }],
    ["no such bone", { bone: 5 }],
    ["an origin of NaN", { origin: Float32Array.of(0, NaN, 0) }],
    ["a cell without size", { cellM: 0 }],
    ["a cell of NaN", { cellM: NaN }],
    ["a node too few", { bytes: skin[0].bytes.slice(1) }],
    ["a flat grid", { dims: [1, 1, skin[0].bytes.length] }],
  ])("with %s has a fault", (_, change) => {
    expect(skinFault(skin)).toBeNull();
    const spoilt = [{ ...skin[0], ...change }, skin[1]] as Skin;
    expect(skinFault(spoilt)).toMatch(/^skin: /);
    expect(() => new SkinPush(spoilt, thicknessM)).toThrow(HairnetError);
  });
});
