import { PerspectiveCamera, Scene, Vector2, type WebGLRenderer } from "three";
import { expect, test } from "vitest";
import { kMovingMax } from "../../src/generated/constants";
import type { MovedLattice } from "../../src/hair/movedLattice";
import { rigidPose } from "../../src/hair/pose";
import { HairMotion } from "../../src/scene/hairMotion";
import { NodeSum } from "../../src/scene/nodeSum";
import { Picture, placeOf } from "../../src/scene/picture";
import { Records } from "../../src/scene/records";
import { shader } from "../../src/scene/shaders";
import { localModule } from "../support/grooms";
import { plainRecord } from "../support/plainRecord";
import { latticeOf } from "../support/shapes";

/**
 * A lattice of 6 nodes on each axis, from -0.5 to 0.5 m, which is sheared: each node moves by `share` times its y along
 * x. Shears of different shares differ everywhere but at y = 0.
 */
function slanted(share: number): MovedLattice {
  // 216 nodes of 3 numbers each; node (i, j, k) has the index i + 6 (j + 6 k).
  const lattice = latticeOf([6, 6, 6], 0.2, [-0.5, -0.5, -0.5]);
  const grid = new Float32Array(3 * 216);
  for (let node = 0; node < 216; ++node) {
    const y = -0.5 + 0.2 * (Math.floor(node / 6) % 6);
    grid[3 * node] = share * y;
  }
  return { lattice, grid };
}

const module = await localModule();

/** A character in a picture: at (x, 0, 0), with a head of `headPx` pixels. `lattice` null: its hair is at rest. */
interface Shown {
  readonly id: number;
  readonly lattice: MovedLattice | null;
  readonly x: number;
  readonly headPx: number;
}

const character = (id: number, lattice: MovedLattice | null, x = 0, headPx = 100): Shown => ({
  id,
  lattice,
  x,
  headPx,
});

/** Writes the records of a picture with these characters, and returns the motions for the average. */
function motionsOf(records: Records, motion: HairMotion, shown: readonly Shown[]) {
  records.begin(module, shown);
  for (const [n, { id, x, headPx }] of shown.entries()) {
    // The last argument is the count of strands, which does not matter here.
    records.measure(n, headPx, 1);
    records.put(n, n, { ...plainRecord, id, pose: rigidPose([0, 0, 0, 1], [x, 0, 0]), size: 1 });
  }
  // 2048 is the largest texture of the device, in rows: far more than these characters need.
  records.write(NodeSum.gpu, 2048);
  return motion.motions();
}

// Decodes a 16-bit float of IEEE 754: a sign, 5 bits of exponent with a bias of 15, and 10 bits of fraction. Those are
// the numbers in the texture of the swing.
const fromHalf = (half: number) => {
  const size = (half & 0x3ff) / 1024;
  const power = (half >> 10) & 31;
  return (half >> 15 ? -1 : 1) * (power === 0 ? size * 2 ** -14 : (1 + size) * 2 ** (power - 15));
};

// `swing` is a texture of displacements: `accumulate.frag` adds one to a point of hair to find the same hair in the
// picture before. With a wrong sign, averaged pictures would smear moving hair.
test("swing leads from where hair is to where it was", () => {
  const records = new Records();
  const motion = new HairMotion(records);
  expect(motion.motions()).toEqual([]);
  expect(motionsOf(records, motion, [character(1, slanted(0.1))])).toEqual([]);
  const [moved] = motionsOf(records, motion, [character(1, slanted(0.3), 0.05)]);
  expect(moved.headToScene.elements[12]).toBeCloseTo(0.05);
  expect(moved.headToSceneBefore.elements[12]).toBe(0);
  // 0.45 is the ball of `plainRecord`. The nodes of the swing fill the box about that ball.
  expect(moved.ballRadiusM).toBeCloseTo(0.45);
  const { data, width } = motion.swing.image as { data: Uint16Array; width: number };
  for (let j = 0; j < width; ++j) {
    const y = ((2 * j) / (width - 1) - 1) * 0.45;
    // The loop reads a column of nodes along y, near the middle of the other two axes.
    const at = 4 * (3 + width * (j + width * 4));
    // The displacement has grown from 0.1 y to 0.3 y, so hair was at -0.2 y from where it is.
    expect(fromHalf(data[at])).toBeCloseTo(-0.2 * y, 3);
    expect(data[at + 1]).toBe(0);
  }
  records.dispose();
  expect(motion.motions()).toEqual([]);
});

test("the motions are those of the largest characters that were in the picture before", () => {
  const records = new Records();
  const motion = new HairMotion(records);
  // Character n is 0.1 n to the right, and its head has 10 n pixels: the place tells who it is.
  const all = Array.from({ length: kMovingMax + 3 }, (_, n) => character(n + 1, null, 0.1 * n, 10 * n));
  // The last and largest character was not in the picture before, so it has no motion yet.
  motionsOf(records, motion, all.slice(0, -1));
  const places = motionsOf(records, motion, all).map((one) => one.headToScene.elements[12]);
  expect(places.length).toBe(kMovingMax);
  // The largest of those that were there before has the index kMovingMax + 1.
  expect(places[0]).toBeCloseTo(0.1 * (kMovingMax + 1));
  records.dispose();
});

test("the shader has room for as many characters, and for their swing", () => {
  const text = shader("accumulate.frag");
  expect(text).toContain(`kMovingMax = ${kMovingMax};`);
  const { width } = new HairMotion(new Records()).swing.image;
  expect(text).toContain(`kSwingNodes = ${width}.0;`);
});

test("the samples' places of 32 pictures are distinct, and even about the pixel's middle", () => {
  const places = Array.from({ length: 32 }, (_, n) => placeOf(n));
  expect(new Set(places.map(({ x, y }) => `${x} ${y}`)).size).toBe(32);
  const mean = places.reduce((sum, place) => sum.add(place), new Vector2()).divideScalar(32);
  // Pixels have a width of 1. A mean far from 0 would shift the average picture. Halton's first 32 points have a mean
  // that is 0.024 pixels off: 0.03 leaves room for another sequence that is as even.
  expect(mean.length()).toBeLessThan(0.03);
  for (const { x, y } of places) expect(Math.max(Math.abs(x), Math.abs(y))).toBeLessThan(0.5);
  expect(placeOf(32)).toEqual(placeOf(0));
});

test("without float targets, and in a headset, it draws as the renderer does", () => {
  const drawn: unknown[] = [];
  const scene = new Scene();
  const camera = new PerspectiveCamera();
  const renderer = (float: boolean, isPresenting: boolean) =>
    ({
      extensions: { has: () => float },
      domElement: new EventTarget(),
      xr: { isPresenting },
      getRenderTarget: () => null,
      render: (...what: unknown[]) => drawn.push(what),
    }) as unknown as WebGLRenderer;
  // The first renderer has no float targets, the second draws for a headset. Neither can average pictures.
  for (const plain of [renderer(false, false), renderer(true, true)]) {
    const picture = new Picture(plain);
    picture.render(scene, camera, null);
    expect(picture.pictures).toBe(0);
    picture.dispose();
  }
  expect(drawn).toEqual([
    [scene, camera],
    [scene, camera],
  ]);
});
