import { PerspectiveCamera, Scene, Vector2, type WebGLRenderer } from "three";
import { expect, test } from "vitest";
import type { MovedLattice } from "../../src/hair/movedLattice";
import { rigidPose } from "../../src/hair/pose";
import { displacementAt, HairMotion, kMovingMax, type MovingCharacter } from "../../src/scene/hairMotion";
import { Picture, placeOf } from "../../src/scene/picture";
import { shader } from "../../src/scene/shaders";
import { latticeOf } from "../support/shapes";

/** Displacements that grow with the place: x += share * y, so that places before and after differ. */
function slanted(share: number, wave = 0): MovedLattice {
  const lattice = latticeOf([6, 6, 6], 0.2, [-0.5, -0.5, -0.5]);
  const grid = new Float32Array(3 * 216);
  for (let node = 0; node < 216; ++node) {
    const y = -0.5 + 0.2 * (Math.floor(node / 6) % 6);
    grid[3 * node] = share * y + wave * Math.sin(12.9898 * node);
  }
  return { lattice, grid };
}

function character(name: object, lattice: MovedLattice | null, x = 0, screenHeight = 0.4): MovingCharacter {
  return {
    character: name,
    pose: rigidPose([0, 0, 0, 1], [x, 0, 0]),
    size: 1,
    ballRadiusM: 0.45,
    screenHeight,
    lattice,
  };
}

const fromHalf = (half: number) => {
  const size = (half & 0x3ff) / 1024;
  const power = (half >> 10) & 31;
  return (half >> 15 ? -1 : 1) * (power === 0 ? size * 2 ** -14 : (1 + size) * 2 ** (power - 15));
};

test("a displacement is that of its node, between nodes it is linear, and beyond the lattice that of the border", () => {
  const lattice = slanted(0.1, 0.03);
  const at = (x: number, y: number, z: number) => displacementAt(lattice, x, y, z, new Float64Array(3))[0];
  const nodeAt = (i: number, j: number, k: number) => lattice.grid[3 * (i + 6 * (j + 6 * k))];
  expect(at(-0.1, 0.1, 0.3)).toBeCloseTo(nodeAt(2, 3, 4), 6);
  const [low, high] = [2, 3].map((i) => 0.75 * nodeAt(i, 3, 4) + 0.25 * nodeAt(i, 4, 4));
  expect(at(-0.02, 0.15, 0.3)).toBeCloseTo(0.6 * low + 0.4 * high, 6);
  expect(at(9, 0.1, -9)).toBeCloseTo(nodeAt(5, 3, 0), 6);
  expect(displacementAt(null, 0, 0, 0, Float64Array.of(1, 2, 3))).toEqual(new Float64Array(3));
});

test("swing leads from where hair is to where it was", () => {
  const motion = new HairMotion();
  const one = {};
  motion.shown = [character(one, slanted(0.1))];
  expect(motion.motions()).toEqual([]);
  motion.remember();
  motion.shown = [character(one, slanted(0.3), 0.05)];
  const [moved] = motion.motions();
  expect(moved.headToScene.elements[12]).toBeCloseTo(0.05);
  expect(moved.headToSceneBefore.elements[12]).toBe(0);
  const { data, width } = motion.swing.image as { data: Uint16Array; width: number };
  for (let j = 0; j < width; ++j) {
    const y = ((2 * j) / (width - 1) - 1) * 0.45;
    const at = 4 * (3 + width * (j + width * 4));
    expect(fromHalf(data[at])).toBeCloseTo(-0.2 * y, 3);
    expect(data[at + 1]).toBe(0);
  }
});

test("the motions are those of the largest characters that were in the picture before", () => {
  const motion = new HairMotion();
  const all = Array.from({ length: kMovingMax + 3 }, (_, n) => character({ n }, null, 0.1 * n, 0.1 * n));
  motion.shown = all.slice(0, -1);
  motion.remember();
  motion.shown = all;
  const places = motion.motions().map((one) => one.headToScene.elements[12]);
  expect(places.length).toBe(kMovingMax);
  expect(places[0]).toBeCloseTo(0.1 * (kMovingMax + 1));
  motion.forget();
  expect(motion.motions()).toEqual([]);
});

test("the shader has room for as many characters, and for their swing", () => {
  const text = shader("accumulate.frag");
  expect(text).toContain(`kMovingMax = ${kMovingMax};`);
  const { width } = new HairMotion().swing.image;
  expect(text).toContain(`kSwingNodes = ${width}.0;`);
});

test("the samples' places of 32 pictures are distinct, and even about the pixel's middle", () => {
  const places = Array.from({ length: 32 }, (_, n) => placeOf(n));
  expect(new Set(places.map(({ x, y }) => `${x} ${y}`)).size).toBe(32);
  const mean = places.reduce((sum, place) => sum.add(place), new Vector2()).divideScalar(32);
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
