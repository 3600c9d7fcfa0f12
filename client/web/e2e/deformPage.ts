// Strands as the GPU places them, for deform.e2e.ts.
import { Group, WebGLRenderer } from "three";
import type { Lattice } from "../src/hair/movedLattice";
import type { SkinGrid } from "../src/hair/skin";
import { Instance } from "../src/module/instance";
import { hairModule } from "../src/module/moduleFile";
import { readGeometry } from "../src/scene/geometry/readGeometry";
import { GroomDrawing } from "../src/scene/groomDrawing";
import { SceneUniforms } from "../src/scene/hairMaterials";
import { LatticePass } from "../src/scene/latticePass";
import { NodeSum } from "../src/scene/nodeSum";
import { Records } from "../src/scene/records";
import { SkinTexture } from "../src/scene/skinTexture";
import { StrandDeformPass } from "../src/scene/strandDeformPass";
import { plainRecord } from "../test/support/plainRecord";

/** A character, as it travels to a page. */
export interface HairNow {
  readonly file: readonly number[];
  readonly pose: readonly number[];
  readonly lattice: Lattice;
  /** The displacements of the lattice's nodes, 3 numbers each. */
  readonly nodes: readonly number[];
  readonly skin: {
    readonly grids: readonly SkinGrid[];
    readonly nodes: readonly number[];
    readonly thicknessM: number;
  };
}

/** What keeps points from where the lattice alone moves them. */
export interface Limits {
  readonly skin: boolean;
  readonly lengths: boolean;
}

/** For each point of the strands 3 numbers at rest and 3 where it is placed, head space, m. */
export async function placeStrands({ file, pose, lattice, nodes, skin }: HairNow, limits: Limits): Promise<number[]> {
  const module = await Instance.of(await hairModule());
  const geometry = readGeometry(module, module.makeOf("hairnet_groom_load", Uint8Array.from(file)), false)!;
  // Points whose number in the strand is 0 are placed by FFD alone (`StrandGeometry.arc`).
  if (!limits.lengths) geometry.strands.arc.fill(0);
  const skinTexture = new SkinTexture();
  if (limits.skin) skinTexture.fill({ ...skin, nodes: Uint8Array.from(skin.nodes) });

  const renderer = new WebGLRenderer();
  const records = new Records();
  const lattices = new LatticePass(records.texture);
  const placement = new StrandDeformPass(records.texture, lattices.texture);
  const uniforms = new SceneUniforms(records.texture, lattices.texture, placement.texture);
  const drawing = new GroomDrawing(geometry, new Group(), uniforms, () => {}, false, skinTexture);
  const rows = drawing.pointRowsOf({ ...plainRecord, list: 0 });
  records.begin(module, [{ lattice: { lattice, grid: Float32Array.from(nodes) } }]);
  records.put(0, 0, { ...plainRecord, pose: Float64Array.from(pose), rowCount: rows });
  lattices.run(renderer, records.write(NodeSum.gpu, renderer.capabilities.maxTextureSize));
  placement.place(renderer, [{ drawing, first: 0, characters: 1 }], rows);
  const { rest } = geometry.strands;
  const placed = placement.read(renderer, drawing.pointsOf(geometry.strandCount));
  if (renderer.getContext().getError() !== 0) throw new Error("the GPU refuses");
  for (const each of [drawing, placement, lattices, records, skinTexture, renderer]) each.dispose();
  return Array.from({ length: (placed.length / 4) * 6 }, (_, n) => {
    const at = 4 * Math.floor(n / 6) + (n % 3);
    return n % 6 < 3 ? rest[at] : placed[at];
  });
}

Object.assign(window, { placeStrands });
