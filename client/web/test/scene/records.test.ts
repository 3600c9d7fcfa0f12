import { Color } from "three";
import { afterEach, describe, expect, test } from "vitest";
import { startClient } from "../../src/module/client";
import { Instance } from "../../src/module/instance";
import { hairModule } from "../../src/module/moduleFile";
import { kCoefficientTexel, kLatticeTexel, kPointRow, kRecordTexels, kTipTexel } from "../../src/generated/constants";
import { nodeCount, type MovedLattice } from "../../src/hair/movedLattice";
import { rigidPose } from "../../src/hair/pose";
import { ModuleLattice, Scene } from "../../src/room/shown";
import { detailFor } from "../../src/scene/drawDetail";
import { FloatTexture } from "../../src/scene/floatTexture";
import { NodeSum, nodeSumFor } from "../../src/scene/nodeSum";
import { Records, type CharacterRecord } from "../../src/scene/records";
import { shader } from "../../src/scene/shaders";
import { localModule, strandsFile } from "../support/grooms";
import { plainRecord } from "../support/plainRecord";

const module = await localModule();
// The lattice has 3 x 4 x 5 nodes with a displacement of 3 numbers each: 180 in all.
const nodes: MovedLattice = {
  lattice: { origin: [-1, -2, -3], spacing: [0.5, 0.25, 0.125], dims: [3, 4, 5] },
  grid: Float32Array.from({ length: 180 }, (_, i) => 0.5 * Math.sin(i)),
};
// A character whose hair is at rest has no lattice.
const rest = { lattice: null };

const records = new Records();
afterEach(() => records.dispose());
// Returns the four numbers of texel `n` of the record in that row.
const texel = (n: number, row = 0) => {
  const { data } = records.texture.image as unknown as { data: Float32Array };
  const at = 4 * (n + kRecordTexels * row);
  return [...data.subarray(at, at + 4)];
};
// Writes the records for a device whose textures have at most 2048 rows, which is far more than these tests need.
const write = (sum = NodeSum.gpu) => records.write(sum, 2048);

// The head of character.glsl lists what each texel has. A number in another place would deform or colour hair wrongly
// without any error.
test("records lie as client/shaders/character.glsl reads them", () => {
  const record: CharacterRecord = {
    ...plainRecord,
    pose: rigidPose([0, 0.6, 0, 0.8], [1, 2, 3]),
    hair: new Color(0.1, 0.2, 0.3),
    hairTip: new Color(0.2, 0.3, 0.4),
    skin: new Color(0.4, 0.5, 0.6),
    roughness: 0.5,
    strands: { ...plainRecord.strands, strandCount: 500, strandWidthM: 4e-4 },
    detail: { strandShare: 0.5, followHairCount: 2, toleranceM: 0, quadratic: 1 },
    // A negative size is a mirrored character, 1.25 times as large as its groom.
    size: -1.25,
    bodyVisible: false,
    firstRow: 7,
    rowCount: 11,
    hasLight: true,
  };
  records.begin(module, [{ lattice: nodes }]);
  records.put(0, 0, record);
  const data = write();
  // The numbers are the head's rotation, then its position and the first row of its strands' points.
  expect(texel(0)).toEqual([0, 0.6, 0, 0.8].map(Math.fround));
  expect(texel(1)).toEqual([1, 2, 3, 7]);
  // The texel has the colour at the root and the width of a strand. Fewer strands are drawn wider, by the power of -0.8
  // of their share (width_scale of client/draw/draw_detail.cpp, whose factor for two follow hairs is 1). The size
  // widens them, too.
  expect(texel(2)).toEqual([0.1, 0.2, 0.3, 4e-4 * 0.5 ** -0.8 * 1.25].map((x) => expect.closeTo(x, 7)));
  // The numbers are the share of the strands and that of the quadratic FFD.
  expect(texel(3)).toEqual([0.5, 1, 0, 0]);
  // The numbers are the follow hairs, the 2.5 mm by which they stray (kStray_m of character_records.cpp), 1 for a
  // lattice that moves the hair, and size - 1.
  expect(texel(4)).toEqual([2, expect.closeTo(0.0025, 7), 1, -2.25]);
  // The colour of the skin is followed by 1, since the body is not drawn.
  expect(texel(5)).toEqual([...[0.4, 0.5, 0.6].map(Math.fround), 1]);
  // The bones are in texels 6 to 15, rotation and position in turn. The head's position has the count of rows beside
  // it, and 15 is the position of the upper trunk.
  expect(texel(7)).toEqual([1, 2, 3, 11]);
  expect(texel(15).slice(0, 3)).toEqual([1, 2, 3]);
  expect(texel(kLatticeTexel)).toEqual([-1, -2, -3, 0]);
  // The shader multiplies, so the record has 1 / spacing.
  expect(texel(kLatticeTexel + 1)).toEqual([2, 4, 8, 0]);
  expect(texel(kLatticeTexel + 2)).toEqual([3, 4, 5, 0]);
  expect(texel(kTipTexel)).toEqual([0.2, 0.3, 0.4, 0.5].map(Math.fround));
  expect(data).toMatchObject({ uploadedRows: 1, nodeRows: 1, lightGrids: 1 });
  // One source has nodes that are uploaded (basis 0), for the one record from 0 to before 1.
  expect(data.sources).toEqual([{ basis: 0, scene: 0, index: 0, first: 0, end: 1 }]);
  // The second node is compared: nodes are 4 floats each in memory and 3 in the grid.
  expect([...module.floats(data.nodes + 4 * 4, 3)]).toEqual([...nodes.grid.subarray(3, 6)]);
});

test("the shader agrees about the width of a row and what its texels are", () => {
  const text = shader("strand.vert");
  expect(text).toContain(`kRecordTexels = ${kRecordTexels};`);
  expect(text).toContain(`kLatticeTexel = ${kLatticeTexel};`);
  expect(text).toContain(`kTipTexel = ${kTipTexel};`);
  expect(text).toContain(`kCoefficientTexel = ${kCoefficientTexel};`);
  expect(text).toContain(`kPointRow = ${kPointRow};`);
});

test("each character has its own, wherever it is in the room, and those that are not drawn have none", () => {
  // Of 50 characters, those from 10 to 49 are drawn, and their records are in the reverse order.
  records.begin(module, new Array(50).fill(rest));
  for (let n = 0; n < 40; ++n)
    records.put(n + 10, 39 - n, { ...plainRecord, pose: rigidPose([0, 0, 0, 1], [n, 0, 0]) });
  write();
  for (let n = 0; n < 40; ++n) expect(texel(1, 39 - n)[0]).toBe(n);
  // In the next picture only the second of two characters is drawn, and its record is the first row.
  records.begin(module, [rest, rest]);
  records.put(1, 0, { ...plainRecord, firstRow: 3 });
  write();
  expect(texel(1)[3]).toBe(3);
});

test("a texture takes at most a few times the memory in use", () => {
  const rows = new FloatTexture(kRecordTexels);
  const height = () => (rows.texture.image as { height: number }).height;
  rows.reserve(1000);
  expect(height()).toBeGreaterThanOrEqual(1000);
  // A little less is needed, and a smaller texture would not be worth its making.
  rows.reserve(900);
  expect(height()).toBeGreaterThanOrEqual(1000);
  rows.reserve(20);
  expect(height()).toBeGreaterThanOrEqual(20);
  // A texture shrinks once it has more than four times the rows in use (FloatTexture.reserve).
  expect(height()).toBeLessThanOrEqual(80);
});

describe("lattices", () => {
  /** Whether each character's hair moves. */
  const moving = (lattices: readonly (MovedLattice | null)[]) => {
    records.begin(
      module,
      lattices.map((lattice) => ({ lattice })),
    );
    for (const n of lattices.keys()) records.put(n, n, plainRecord);
    write();
    return lattices.map((_, n) => texel(4, n)[2] === 1);
  };

  test("that are not whole, or not finite, move nothing", () => {
    const broken = (what: Partial<MovedLattice["lattice"]>) => ({ ...nodes, lattice: { ...nodes.lattice, ...what } });
    const all = [
      nodes,
      null,
      { ...nodes, grid: new Float32Array(180).fill(NaN) },
      // 180 numbers are needed.
      { ...nodes, grid: new Float32Array(30) },
      broken({ spacing: [0, 1, 1] }),
      broken({ origin: [NaN, 1, 1] }),
      // The 180 numbers fit these dimensions, but one node along an axis spans no cell.
      { ...broken({ dims: [1, 12, 15] }) },
      nodes,
    ];
    expect(moving(all)).toEqual([true, false, false, false, false, false, false, true]);
  });

  test("of a scene are read where they are, and those of another module are copied", async () => {
    const groom = module.makeOf("hairnet_groom_load", await strandsFile(20, 6));
    const levels = module.make("hairnet_build_finish", module.make("hairnet_build_begin", groom));
    // A world of 60 ticks a second has one character, whose head turns for 0.3 s: long enough for its hair to lag
    // behind.
    const world = module.make("hairnet_world_make", 60);
    const poseAt = (s: number) => new Uint8Array(rigidPose([0, Math.sin(s), 0, Math.cos(s)]).buffer);
    const own = module.with(poseAt(0), (at) => module.made("", "hairnet_world_add", world, groom, levels, 0, at));
    for (let s = 0; s < 0.3; s += 1 / 60) {
      module.with(poseAt(s), (at) => module.call("hairnet_world_push_pose", world, own, at, 0));
      module.call("hairnet_world_advance", world, 1 / 60);
    }
    const scene = new Scene(module, module.call("hairnet_world_scene", world), module);
    expect(scene.read()).toBe(1);
    const lattice = new ModuleLattice(scene, scene.at(0), 0);
    const count = nodeCount(lattice.lattice);
    // The hair must have moved, or a comparison of zeros would prove nothing.
    // A centimetre is far above any rounding.
    expect(Math.max(...lattice.grid)).toBeGreaterThan(0.01);
    expect(lattice.modes).toBeUndefined();
    // The first picture is of the module that has the scene, the second of another module.
    for (const by of [module, await Instance.of(await hairModule())]) {
      records.begin(by, [{ lattice }]);
      records.put(0, 0, plainRecord);
      const data = write();
      expect(texel(4)[2]).toBe(1);
      const written = by.floats(data.nodes, 4 * count);
      // Nodes are 4 floats each in memory and 3 in the grid.
      for (let i = 0; i < 3 * count; ++i) expect(written[4 * Math.floor(i / 3) + (i % 3)]).toBe(lattice.grid[i]);
    }
  });

  test("lose their rows with the context, and nodes without modes are sent each time", () => {
    records.begin(module, [{ lattice: nodes }]);
    records.put(0, 0, plainRecord);
    expect(write().uploadedRows).toBe(1);
    records.forget();
    records.begin(module, [{ lattice: nodes }, rest]);
    records.put(0, 0, plainRecord);
    expect(write()).toMatchObject({ uploadedRows: 1, nodeRows: 1 });
  });
});

test("the detail is chosen for all by their sizes", async () => {
  await startClient();
  // The first head has 95 pixels and 12 000 strands, the second 700 pixels and 300 strands. Both details must equal
  // those of `detailFor`, which asks the module for one character alone.
  records.begin(module, [rest, rest]);
  records.measure(0, 95, 12000);
  records.measure(1, 700, 300);
  records.chooseDetails(0.5);
  const detail = { strandShare: 0, followHairCount: 0, toleranceM: 0, quadratic: 0 };
  records.readDetail(0, detail);
  expect(detail).toEqual(detailFor(95, 0.5, 12000));
  records.readDetail(1, detail);
  expect(detail).toEqual(detailFor(700, 0.5, 300));
  // At a quality of 0.5 a head of 700 pixels counts as 350. A head of that size has all of 300 strands, two follow
  // hairs and the quadratic FFD.
  expect(detail).toMatchObject({ strandShare: 1, followHairCount: 2, quadratic: 1 });
  // A head of 0.24 m (kHeadM) has 350 pixels here. The strand may be 0.35 of such a pixel off (tolerance_m of
  // client/draw/draw_detail.cpp).
  expect(detail.toleranceM).toBeCloseTo((0.35 * 0.24) / 350, 9);
});

// Such software takes longer for the sum than the processor by itself, so pictures would take longer, too.
test("software that plays a GPU leaves the sum of nodes to the processor", () => {
  // The names are what Chromium gives as UNMASKED_RENDERER_WEBGL. SwiftShader plays a GPU on the processor.
  expect(nodeSumFor(module, "ANGLE (Google, Vulkan 1.3.0 (SwiftShader Device), SwiftShader driver)")).toBe(
    NodeSum.processor,
  );
  expect(nodeSumFor(module, "ANGLE (NVIDIA, NVIDIA GeForce RTX 3060)")).toBe(NodeSum.gpu);
});
