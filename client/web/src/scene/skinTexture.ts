import { DataTexture, type IUniform } from "three";
import { kSkinRow } from "../generated/constants";
import { kBoneCount } from "../hair/pose";
import type { Skin } from "../hair/skin";

/**
 * A groom's skin on the GPU, for the shaders that push hair out of it (skin_push.glsl). Before `fill` none is known.
 */
export class SkinTexture {
  /** The uniforms by their names in the shaders, which say what each has. */
  readonly uniforms = {
    skin_nodes: { value: null as DataTexture | null },
    skin_place: { value: new Float32Array(4 * kBoneCount) },
    skin_dims: { value: new Float32Array(4 * kBoneCount) },
    skin_thickness: { value: 0 },
  } satisfies Record<string, IUniform>;

  #skin: Skin | null = null;

  /** Takes over a skin. The same object again costs nothing. */
  fill(skin: Skin): void {
    if (skin === this.#skin) return;
    this.dispose();
    this.#skin = skin;
    const { skin_nodes, skin_place, skin_dims, skin_thickness } = this.uniforms;
    // A bone with a cell of 0 m has no grid.
    skin_place.value.fill(0);
    for (const { bone, origin, cellM, dims, first } of skin.grids) {
      skin_place.value.set([...origin, cellM], 4 * bone);
      skin_dims.value.set([...dims, first], 4 * bone);
    }
    skin_thickness.value = skin.thicknessM;
    const rows = Math.floor(skin.nodes.length / 4 / kSkinRow) + 1;
    const texels = new Uint8Array(4 * kSkinRow * rows);
    texels.set(skin.nodes);
    skin_nodes.value = new DataTexture(texels, kSkinRow, rows);
    skin_nodes.value.needsUpdate = true;
  }

  dispose(): void {
    this.uniforms.skin_nodes.value?.dispose();
    this.uniforms.skin_nodes.value = null;
    this.#skin = null;
  }
}
