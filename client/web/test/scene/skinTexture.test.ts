import { Group, Texture } from "three";
import { expect, it } from "vitest";
import { kSkinRow } from "../../src/generated/constants";
import { SkinPush } from "../../src/hair/skinPush";
import { CharacterRecords } from "../../src/scene/characterRecords";
import { makeGroomGeometry } from "../../src/scene/geometry/makeGroomGeometry";
import { GroomDrawing } from "../../src/scene/groomDrawing";
import { SceneUniforms } from "../../src/scene/hairMaterials";
import { SkinTexture } from "../../src/scene/skinTexture";
import { madeGroom } from "../support/madeGroom";
import { skinVector } from "../support/skinVector";

const { skin, thicknessM } = skinVector();

it("has no grid before a skin is known, then those of its bones", () => {
  const texture = new SkinTexture();
  const { skin_nodes, skin_place, skin_dims, skin_thickness } = texture.uniforms;
  expect(skin_place.value.every((x) => x === 0)).toBe(true);
  expect(texture.bytes).toBe(0);
  const push = new SkinPush(skin, thicknessM);
  texture.fill(push);
  expect(skin_thickness.value).toBe(thicknessM);
  for (const { bone, origin, cellM, dims, first } of push.grids) {
    expect(skin_place.value.subarray(4 * bone, 4 * bone + 4)).toEqual(Float32Array.of(...origin, cellM));
    expect(skin_dims.value.subarray(4 * bone, 4 * bone + 4)).toEqual(Float32Array.of(...dims, first));
  }
  const { data, width } = skin_nodes.value!.image;
  expect(width).toBe(kSkinRow);
  expect((data as Uint8Array).subarray(0, push.nodes.length)).toEqual(push.nodes);
  texture.fill(new SkinPush(skin.slice(0, 1), thicknessM));
  expect(skin_place.value[4 * skin[1].bone + 3]).toBe(0);
});

it("reaches the materials of cards that were made before it was known", () => {
  const uniforms = new SceneUniforms(new CharacterRecords().texture, new Texture(), new Texture());
  const made = makeGroomGeometry(madeGroom());
  const geometry = { ...made, farCards: { ...made.farCards, triangles: Uint32Array.of(0, 1, 2) }, farCardCount: 3 };
  const thickness: number[] = [];
  const texture = new SkinTexture();
  const read: (() => number)[] = [];
  const adapt = ({ uniforms: own }: { uniforms: Record<string, { value: number }> }, part: string) => {
    if (part === "card") read.push(() => own.skin_thickness.value);
  };
  new GroomDrawing(geometry, new Group(), uniforms, adapt, false, texture);
  texture.fill(new SkinPush(skin, thicknessM));
  for (const value of read) thickness.push(value());
  expect(thickness).toEqual([thicknessM]);
});
