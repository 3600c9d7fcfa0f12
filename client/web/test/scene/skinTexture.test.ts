import { Group, Texture } from "three";
import { expect, it } from "vitest";
import { kSkinRow } from "../../src/generated/constants";
import { Bone } from "../../src/hair/pose";
import type { Skin } from "../../src/hair/skin";
import { GroomDrawing } from "../../src/scene/groomDrawing";
import { SceneUniforms } from "../../src/scene/hairMaterials";
import { SkinTexture } from "../../src/scene/skinTexture";
import { geometryOf, strandsFile } from "../support/grooms";

// A skin of two bones' grids: 3 x 4 x 5 = 60 nodes of the head, then 5 x 6 x 7 = 210 nodes of the left shoulder. Each
// node has 4 bytes.
const skin: Skin = {
  grids: [
    { bone: Bone.head, origin: [-0.1, -0.2, -0.3], cellM: 0.02, dims: [3, 4, 5], first: 0 },
    { bone: Bone.leftShoulder, origin: [0.1, 0.2, 0.3], cellM: 0.03, dims: [5, 6, 7], first: 60 },
  ],
  nodes: Uint8Array.from({ length: 4 * (60 + 210) }, (_, n) => n % 251),
  thicknessM: 0.006,
};

it("has no grid before a skin is known, then those of its bones", () => {
  const texture = new SkinTexture();
  const { skin_nodes, skin_place, skin_dims, skin_thickness } = texture.uniforms;
  expect(skin_place.value.every((x) => x === 0)).toBe(true);
  expect(skin_nodes.value).toBeNull();
  texture.fill(skin);
  expect(skin_thickness.value).toBe(skin.thicknessM);
  for (const { bone, origin, cellM, dims, first } of skin.grids) {
    expect(skin_place.value.subarray(4 * bone, 4 * bone + 4)).toEqual(Float32Array.of(...origin, cellM));
    expect(skin_dims.value.subarray(4 * bone, 4 * bone + 4)).toEqual(Float32Array.of(...dims, first));
  }
  const { data, width } = skin_nodes.value!.image;
  expect(width).toBe(kSkinRow);
  expect((data as Uint8Array).subarray(0, skin.nodes.length)).toEqual(skin.nodes);
  // The same object again makes no new texture. A skin with fewer grids leaves nothing of the one before: a cell of
  // 0 m means that the bone has no grid.
  const before = skin_nodes.value;
  texture.fill(skin);
  expect(skin_nodes.value).toBe(before);
  texture.fill({ ...skin, grids: skin.grids.slice(0, 1) });
  expect(skin_place.value[4 * Bone.leftShoulder + 3]).toBe(0);
});

// Materials take over their uniforms when they are made. The skin comes later, so it must be written into these
// uniforms, and not replace them.
it("reaches the materials of cards that were made before it was known", async () => {
  const uniforms = new SceneUniforms(new Texture(), new Texture(), new Texture());
  const texture = new SkinTexture();
  const read: (() => number)[] = [];
  const adapt = ({ uniforms: own }: { uniforms: Record<string, { value: number }> }, part: string) => {
    if (part === "card") read.push(() => own.skin_thickness.value);
  };
  const made = await geometryOf(await strandsFile());
  // The groom of the test has no cards. One triangle makes GroomDrawing create their mesh and material.
  const geometry = { ...made, cards: { ...made.cards, triangles: Uint32Array.of(0, 1, 2) } };
  new GroomDrawing(geometry, new Group(), uniforms, adapt, false, texture);
  texture.fill(skin);
  expect(read.map((value) => value())).toEqual([skin.thicknessM]);
});
