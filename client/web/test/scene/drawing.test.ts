import { describe, expect, test } from "vitest";
import {
  Euler,
  Group,
  type Matrix4,
  PerspectiveCamera,
  Quaternion,
  Texture,
  Vector2,
  Vector3,
  type RawShaderMaterial,
  type WebGLRenderer,
} from "three";
import { kNumbersPerBone, kPoseNumbers, rigidPose, type Pose } from "../../src/hair/pose";
import { startClient } from "../../src/module/client";
import { detailFor } from "../../src/scene/drawDetail";
import { GroomDrawing, inDrawingOrder, type DrawCounts } from "../../src/scene/groomDrawing";
import { HairCharacter } from "../../src/scene/hairCharacter";
import { SceneUniforms } from "../../src/scene/hairMaterials";
import { place, type Placed } from "../../src/scene/placement";
import { shader } from "../../src/scene/shaders";
import { fitShares } from "../../src/scene/strandDeformPass";
import { seenBy, viewsOf } from "../../src/scene/view";
import { geometryOf, strandsFile } from "../support/grooms";

describe("draw calls", async () => {
  const made = await geometryOf(await strandsFile());
  await startClient();
  const counts = (): DrawCounts => ({ drawCalls: 0, strands: 0, vertices: 0 });
  const group = new Group();
  const uniforms = new SceneUniforms(new Texture(), new Texture(), new Texture());
  const materials: RawShaderMaterial[] = [];
  const drawing = new GroomDrawing(made, group, uniforms, (material) => materials.push(material));
  /**
   * A character whose head is `px` pixels high, with the detail and the list of strands that belong to that size
   * (detail_for of client/draw/draw_detail.cpp). At 400 pixels each strand has two follow hairs and a tolerance of 0.2
   * mm; at 30 pixels it has none and 2.8 mm.
   */
  const at = (px: number) => {
    const detail = detailFor(px, 1, drawing.strandCount);
    return { detail, list: drawing.listFor(detail.toleranceM) };
  };

  test("characters of one groom and one drawing level share one", () => {
    const drawn = counts();
    drawing.show(
      // The 20 characters have the records from 5 on, as if another groom had those from 0 to 4.
      Array.from({ length: 20 }, () => at(400)),
      5,
      drawn,
    );
    // One draw call is that of the body, the other that of the strands.
    expect(drawn.drawCalls).toBe(2);
    const strand = group.children.filter((mesh) => mesh.visible && mesh.name === "hairnet strand");
    expect(strand).toHaveLength(1);
    const { geometry, material } = strand[0] as unknown as {
      geometry: { instanceCount: number };
      material: RawShaderMaterial;
    };
    // A copy is the strand or one of its follow hairs.
    expect(geometry.instanceCount).toBe(20 * material.uniforms.copies.value);
    expect(material.uniforms.first_record.value).toBe(5);
  });

  // Each character's points get rows of a texture (`StrandDeformPass`). Too few rows would let characters overwrite
  // each other's hair.
  test("strands and rows for their points are as many as their share needs", async () => {
    // Each strand has 12 points (madeGroom.ts), at distances over 1.2 cm: strand_geometry.cpp puts one between any two,
    // which makes 23. A row of the texture has 1024.
    const large = new GroomDrawing(await geometryOf(await strandsFile(2000)), new Group(), uniforms, () => {});
    const of = (strandShare: number) => {
      const drawn = { detail: { ...detailFor(400, 1, 2000), strandShare }, list: 0 };
      return { strands: large.strandsOf(drawn), rows: large.pointRowsOf(drawn) };
    };
    expect(of(0)).toEqual({ strands: 0, rows: 0 });
    // A part of a strand is drawn as a whole one, and a part of a row is a row.
    expect(of(1e-6)).toEqual({ strands: 1, rows: 1 });
    // 0.1236 * 2000 is 247.2; the points of 248 strands are 5704, or 5.6 rows.
    expect(of(0.1236)).toEqual({ strands: 248, rows: 6 });
    // The points of half of the strands fill 22.5 rows, and those of all 44.9.
    expect(of(0.5)).toEqual({ strands: 1000, rows: 23 });
    expect(of(1)).toEqual({ strands: 2000, rows: 45 });
    // At 100 pixels the share is 10 000 * (100 / 350)^1.3 of 2000 strands (draw_detail.cpp), which are 1962.06 of them.
    const detail = detailFor(100, 1, 2000);
    expect(large.strandsOf({ detail, list: 0 })).toBe(1963);
  });

  test("points that have no room take strands from all alike", async () => {
    // Each character has some ten rows of points, so that a cut of a few rows leaves most strands.
    const large = await geometryOf(await strandsFile(2000));
    const many = new GroomDrawing(large, new Group(), uniforms, () => {});
    const one = (px: number) => ({ detail: detailFor(px, 1, many.strandCount), list: 0 });
    const shown = [one(400), one(300)];
    const wanted = shown.map(({ detail }) => detail.strandShare);
    const rows = () => shown.reduce((sum, each) => sum + many.pointRowsOf(each), 0);
    expect(rows()).toBeGreaterThan(8);
    // With 1000 rows there is room for all, so nothing may change.
    fitShares([{ drawing: many, shown }], 1000);
    expect(shown.map(({ detail }) => detail.strandShare)).toEqual(wanted);
    // Two rows less than both need: the strands of both must be cut by the same factor.
    const most = rows() - 2;
    fitShares([{ drawing: many, shown }], most);
    expect(rows()).toBeLessThanOrEqual(most);
    // Two rows and one for each character are four of about twenty, so most strands must be left.
    expect(shown[0].detail.strandShare).toBeGreaterThan(0.5 * wanted[0]);
    expect(shown[0].detail.strandShare / wanted[0]).toBeCloseTo(shown[1].detail.strandShare / wanted[1], 6);
  });

  // A strand's points are omitted by a tolerance, and each tolerance has its own list of vertices. Characters with
  // another list need another draw call, whose records follow those of the call before.
  test("another drawing level is another draw call, which begins at its own records", () => {
    const drawn = counts();
    drawing.show([at(400), at(400), at(30)], 0, drawn);
    // The body is drawn once, and the strands once for each of the two levels. The third character is 30 pixels high.
    expect(drawn.drawCalls).toBe(3);
    const firsts = group.children
      .filter((mesh) => mesh.visible && mesh.name === "hairnet strand")
      .map((mesh) => (mesh as unknown as { material: RawShaderMaterial }).material.uniforms.first_record.value);
    expect(firsts.sort((a, b) => a - b)).toEqual([0, 2]);
  });

  // A program may set the detail of a character (`HairCharacter.detail`). Characters that are sorted by anything but
  // their list would need more draw calls than a mesh has, and some would not be drawn.
  test("with details of their own, too, all are drawn: those of one list together", () => {
    const hall = new Group();
    const mixed = new GroomDrawing(made, hall, uniforms, () => {});
    // Without follow hairs an instance of a mesh is one character.
    const one = (list: number, strandShare: number) => ({
      list,
      detail: { ...detailFor(400, 1, 40), followHairCount: 0, strandShare },
    });
    const shown = [one(1, 1), one(0, 0.5), one(1, 0.5), one(0, 1)].sort(inDrawingOrder);
    const drawn = counts();
    mixed.show(shown, 0, drawn);
    const strands = hall.children.filter((mesh) => mesh.visible && mesh.name === "hairnet strand");
    const instances = strands.map(
      (mesh) => (mesh as unknown as { geometry: { instanceCount: number } }).geometry.instanceCount,
    );
    // Each of the two lists has two characters, whatever their shares are.
    expect(instances).toEqual([2, 2]);
  });

  test("draws nothing without members, and disposed objects leave the scene", () => {
    const drawn = counts();
    drawing.show([], 0, drawn);
    expect(drawn.drawCalls).toBe(0);
    expect(group.children.some((mesh) => mesh.visible)).toBe(false);
    // The caller could adapt the material of every mesh: `materials` has what GroomDrawing gave it.
    expect(materials.length).toBe(group.children.length);
    drawing.dispose();
    expect(group.children).toHaveLength(0);
  });
});

describe("placement", () => {
  const pose = rigidPose([0, 0, 0, 1], [1, 1.6, 0]);
  // The neck (numbers 7 to 13) is not where the rigid pose has it, so that a bone with a place of its own is tested.
  pose.set([0, 0, 0, 1, 1, 1.5, 0.25], 7);
  const placed = (character: HairCharacter, of: Pose, room: Matrix4): Placed => {
    const where = place(character, of, room);
    if (typeof where === "string") throw new Error(where);
    return where;
  };
  /** Where a point that hangs on a bone (head space) is drawn: it is moved as body.vert moves it. */
  const drawnAt = ({ pose: at, size }: Placed, bone: number, point: Vector3) =>
    point
      .clone()
      .multiplyScalar(size)
      .applyQuaternion(new Quaternion().fromArray(at, kNumbersPerBone * bone))
      .add(new Vector3().fromArray(at, kNumbersPerBone * bone + 4));

  test("the room's matrix moves, turns and scales all characters", () => {
    // The arguments are the member's number, whether it is an own one, and the key of its groom.
    const character = new HairCharacter(1, false, "");
    const room = new Group();
    room.position.set(0, 0, 10);
    room.rotation.y = Math.PI / 2;
    room.scale.setScalar(2);
    room.updateMatrixWorld();
    const { pose: at, size } = placed(character, pose, room.matrixWorld);
    expect(size).toBeCloseTo(2);
    expect(at[4]).toBeCloseTo(0);
    // The head at (1, 1.6, 0) is doubled, turned by 90 degrees about +Y to (0, 3.2, -2), and moved by 10 along z.
    expect(at[5]).toBeCloseTo(3.2);
    expect(at[6]).toBeCloseTo(8);
    room.add(character);
    room.updateMatrixWorld();
    const head = new Vector3().setFromMatrixPosition(character.matrixWorld);
    expect(head.toArray()).toEqual([0, 1, 2].map((a) => expect.closeTo(at[4 + a], 6)));
  });

  test("an anchor takes the head, and the other bones keep their places about it, as much larger as it is", () => {
    const character = new HairCharacter(1, false, "");
    const anchor = new Group();
    anchor.position.set(5, 0, 0);
    anchor.scale.setScalar(1.5);
    character.anchor = anchor;
    const room = new Group();
    const { pose: at, size } = placed(character, pose, room.matrixWorld);
    expect(size).toBeCloseTo(1.5);
    expect([...at.subarray(4, 7)]).toEqual([5, 0, 0]);
    // The neck is 0.1 m below and 0.25 m in front of the head; the anchor makes both 1.5 times as much.
    expect([...at.subarray(11, 14)]).toEqual([5, expect.closeTo(-0.15), expect.closeTo(0.375)]);
    expect(at).toHaveLength(kPoseNumbers);
    expect(character.position.x).toBe(5);
  });

  test("a mirrored room mirrors every point of every bone, whichever axes its scale mirrors", () => {
    const turned = Float64Array.from(pose);
    turned.set(new Quaternion().setFromEuler(new Euler(0.3, -0.7, 0.2)).toArray(), 0);
    turned.set(new Quaternion().setFromEuler(new Euler(-0.2, 0.4, 0.9)).toArray(), 7);
    // A mirror along one axis or along all three turns the room inside out. One along two axes is half a turn, and the
    // last scale mirrors nothing.
    for (const scale of [
      [-1, 1, 1],
      [2, -2, 2],
      [-0.5, -0.5, -0.5],
      [-1, -1, 1],
      [3, 3, 3],
    ] as const) {
      const parent = new Group();
      parent.scale.fromArray(scale);
      parent.rotation.set(0.4, 0.5, -0.6);
      const room = new Group();
      room.position.set(1, 2, 3);
      room.rotation.set(-0.3, 1, 2);
      parent.add(room);
      room.updateWorldMatrix(true, false);
      const character = new HairCharacter(1, false, "");
      const where = placed(character, turned, room.matrixWorld);
      for (const bone of [0, 1]) {
        const point = new Vector3(0.1, 0.2, -0.3);
        const wanted = drawnAt({ pose: turned, size: 1 }, bone, point).applyMatrix4(room.matrixWorld);
        expect(drawnAt(where, bone, point).distanceTo(wanted)).toBeLessThan(1e-9);
      }
    }
  });

  test("a mirrored anchor mirrors the head, and what hangs on the character too", () => {
    const character = new HairCharacter(1, false, "");
    const anchor = new Group();
    anchor.position.set(5, 1, 0);
    anchor.rotation.set(0.2, 0.8, -0.1);
    anchor.scale.set(-1.5, 1.5, 1.5);
    character.anchor = anchor;
    const room = new Group();
    room.scale.setScalar(2);
    room.position.set(0, 1, 0);
    room.add(character);
    room.updateMatrixWorld();
    const where = placed(character, pose, room.matrixWorld);
    const point = new Vector3(0.1, 0.2, -0.3);
    // The anchor alone places the head: the room's scale and position must not count a second time.
    const wanted = point.clone().applyMatrix4(anchor.matrixWorld);
    expect(drawnAt(where, 0, point).distanceTo(wanted)).toBeLessThan(1e-9);
    room.updateMatrixWorld();
    expect(point.clone().applyMatrix4(character.matrixWorld).distanceTo(wanted)).toBeLessThan(1e-9);
  });

  test("a scale of 0 hides; one that is uneven, sheared or not finite is no place", () => {
    const at = (...scale: [number, number, number]) => {
      const room = new Group();
      room.scale.set(...scale);
      room.updateMatrixWorld();
      return place(new HairCharacter(1, false, ""), pose, room.matrixWorld);
    };
    expect(at(0, 0, 0)).toBe("hidden");
    expect(at(1, 2, 1)).toMatch(/scaled unevenly/);
    expect(at(1, 0, 1)).toMatch(/scaled unevenly/);
    expect(at(1, NaN, 1)).toMatch(/not finite/);
    expect(at(1, Infinity, 1)).toMatch(/not finite/);
    // A shear keeps the lengths of some axes, but not their angles: no rotation with one scale equals it.
    const sheared = new Group();
    sheared.matrixWorld.makeShear(0, 0, 0.5, 0, 0, 0);
    expect(place(new HairCharacter(1, false, ""), pose, sheared.matrixWorld)).toMatch(/scaled unevenly/);
  });
});

describe("how a head is seen", () => {
  const pose = rigidPose([0, 0, 0, 1], [0, 0, -2]);
  /** The views of a square canvas of that height, from a camera at the origin. Without a height the aspect is NaN. */
  const through = (heightPx: number) => {
    const camera = new PerspectiveCamera(40, heightPx > 0 ? 1 : NaN);
    const size = new Vector2(heightPx, heightPx);
    const renderer = { xr: { isPresenting: false }, getDrawingBufferSize: (out: Vector2) => out.copy(size) };
    return viewsOf(renderer as unknown as WebGLRenderer, camera);
  };

  test("an enlarged one is larger, and none larger than servers take", () => {
    const [one, two] = [1, 2].map((size) => seenBy(through(600), pose, 0.5, size));
    expect(two.screenHeight).toBeCloseTo(2 * one.screenHeight, 6);
    expect(two.headPx).toBeCloseTo(2 * one.headPx, 6);
    // A head of 0.24 m, 2 m away, in a view of 40 degrees: half of the view is tan(pi / 9) times the distance.
    expect(one.screenHeight).toBeCloseTo(0.24 / (2 * 2 * Math.tan(Math.PI / 9)), 6);
    // Servers refuse a larger screen height (kScreenHeightMax).
    expect(seenBy(through(600), pose, 0.5, 1e6).screenHeight).toBe(100);
  });

  test("on a canvas of no height it has none", () => {
    expect(seenBy(through(0), pose, 0.5, 1)).toMatchObject({ headPx: 0, screenHeight: 0 });
  });
});

// three.js writes the version line itself, and a second one, or a name that is declared twice, would not compile.
test("shaders contain each included file once, and no version line", () => {
  for (const name of [
    "strand.vert",
    "strand.frag",
    "card.vert",
    "card.frag",
    "body.vert",
    "body.frag",
    "fabric.vert",
    "fabric.frag",
  ]) {
    const text = shader(name);
    expect(text).not.toMatch(/^#(include|version)/m);
    // viewMatrix is declared in scene.glsl, which several other files include.
    expect(text.match(/uniform mat4 viewMatrix/g)).toHaveLength(1);
    expect(text.startsWith("precision")).toBe(true);
  }
  expect(() => shader("nothing.glsl")).toThrow("nothing.glsl");
});
