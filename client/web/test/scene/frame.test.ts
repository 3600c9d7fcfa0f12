import { describe, expect, test } from "vitest";
import { Group, OrthographicCamera, PerspectiveCamera, Vector3 } from "three";
import type { ShownMember } from "../../src/hair/hairSource";
import { HairnetError } from "../../src/module/hairnetError";
import { rigidPose } from "../../src/hair/pose";
import { checkFrame, frameCamera, type Framed } from "../../src/scene/frameCamera";
import { HairScene } from "../../src/scene/hairScene";
import { idleRenderer as renderer } from "../support/idleRenderer";
import { someGroom } from "../support/grooms";

const groom = await someGroom();
const shape = { points: groom.points, body: groom.body };
/** A character at (x, y, z), m, which is turned by `yaw` rad about +Y. */
const at = (x: number, y: number, z: number, yaw = 0): Framed => ({
  pose: rigidPose([0, Math.sin(yaw / 2), 0, Math.cos(yaw / 2)], [x, y, z]),
  size: 1,
  groom: shape,
});

/** The largest |x| and |y| of all points of hair and body in the picture, which is -1 to 1. */
function extent(camera: PerspectiveCamera, characters: readonly Framed[]): { x: number; y: number } {
  camera.updateProjectionMatrix();
  camera.updateWorldMatrix(true, false);
  // `nearest` is the largest z in the camera's own axes, where the camera looks along -z.
  const most = { x: 0, y: 0 };
  let nearest = -Infinity;
  const point = new Vector3();
  for (const { pose, size } of characters)
    for (const points of [shape.points, shape.body.vertices])
      for (let i = 0; i < points.length; i += 3) {
        point.fromArray(points, i).multiplyScalar(size);
        point.applyQuaternion({ x: pose[0], y: pose[1], z: pose[2], w: pose[3] } as never);
        point.add(new Vector3(pose[4], pose[5], pose[6]));
        nearest = Math.max(nearest, point.clone().applyMatrix4(camera.matrixWorldInverse).z);
        point.project(camera);
        most.x = Math.max(most.x, Math.abs(point.x));
        most.y = Math.max(most.y, Math.abs(point.y));
      }
  // A point behind the camera has z above 0, and its projection would look as if it were in the picture.
  expect(nearest).toBeLessThan(0);
  return most;
}

describe("a framed picture", () => {
  test("shows all of one character or many, wide or tall, and nearly fills one side", () => {
    const groups = [[at(0, 0, 0)], [at(5, 1.6, -3, 1)], [at(-1, 1.6, 0), at(0, 1.6, -0.5), at(1, 1.5, 0.3)]];
    // The aspects are those of an upright phone, a square and a wide screen.
    for (const characters of groups)
      for (const aspect of [0.46, 1, 16 / 9])
        for (const fov of [20, 35, 75]) {
          const camera = new PerspectiveCamera(fov, aspect);
          frameCamera(camera, characters, 1);
          const { x, y } = extent(camera, characters);
          expect(Math.max(x, y)).toBeLessThan(1);
          // The camera frames the box around hair and body. Its corners are further out than any point, so the points
          // themselves need not reach the border of 1.
          expect(Math.max(x, y)).toBeGreaterThan(0.7);
        }
  });

  test("leaves the margin", () => {
    const camera = new PerspectiveCamera(35, 1.5);
    const heights = [1, 2].map((margin) => {
      frameCamera(camera, [at(0, 1.6, 0)], margin);
      return extent(camera, [at(0, 1.6, 0)]).y;
    });
    // A margin of 2 shows everything at half the size; perspective makes the ratio only approximately 0.5.
    expect(heights[1] / heights[0]).toBeGreaterThan(0.4);
    expect(heights[1] / heights[0]).toBeLessThan(0.6);
  });

  test("is taken from the front, level, whichever way the trunks face", () => {
    for (const yaw of [0, 0.7, 2, -2.5]) {
      const camera = new PerspectiveCamera(35, 1);
      const target = frameCamera(camera, [at(2, 1.6, 1, yaw)])!;
      const front = camera.position.clone().sub(target).normalize();
      expect(front.toArray()).toEqual([Math.sin(yaw), 0, Math.cos(yaw)].map((x) => expect.closeTo(x, 6)));
    }
    const camera = new PerspectiveCamera(35, 1);
    // Two characters that stand face to face have no mean direction to look from: the sum of their directions is 0.
    frameCamera(camera, [at(0, 0, 0), at(0, 0, 1, Math.PI)]);
    expect(camera.position.toArray().every(Number.isFinite)).toBe(true);
  });

  test("is the same with a camera that another object carries", () => {
    const rig = new Group();
    rig.position.set(3, -1, 2);
    rig.rotation.y = 0.8;
    const camera = new PerspectiveCamera(35, 1);
    rig.add(camera);
    frameCamera(camera, [at(0, 1.6, 0)], 1);
    const { x, y } = extent(camera, [at(0, 1.6, 0)]);
    expect(Math.max(x, y)).toBeLessThan(1);
  });
});

test("a camera without a finite aspect, as of a canvas without a size, stays where it is", () => {
  const camera = new PerspectiveCamera(35, NaN);
  expect(frameCamera(camera, [at(0, 1.6, 0)])).toBeNull();
  expect(camera.position.toArray()).toEqual([0, 0, 0]);
});

test("frame refuses what it cannot do", () => {
  const camera = new PerspectiveCamera();
  // In each pair of a camera and options one thing is wrong. The first two have no perspective camera. Then come a
  // misspelt option, margins that are not above 0, a name in place of a member's number, and no object as options.
  for (const bad of [
    [new OrthographicCamera(), {}],
    [undefined, {}],
    [camera, { margn: 2 }],
    [camera, { margin: 0 }],
    [camera, { margin: NaN }],
    [camera, { member: "Ann" }],
    [camera, 2],
  ])
    expect(() => checkFrame(bad[0] as never, bad[1] as never)).toThrow(HairnetError);
  expect(() => checkFrame(camera, { margin: 0.5, member: 3 })).not.toThrow();
});

describe("a HairScene", () => {
  test("refuses a room that has not been awaited, a missing renderer and a misspelt option", () => {
    const source = { sample: () => [] };
    for (const make of [
      () => new HairScene(Promise.resolve(source) as never, renderer),
      () => new HairScene(undefined as never, renderer),
      () => new HairScene(source, undefined as never),
      () => new HairScene(source, renderer, { light: "scene" } as never),
    ])
      expect(make).toThrow(HairnetError);
  });

  test("draws a member that its source names twice once", async () => {
    // The scene has one `HairCharacter` for each member's number. A second one in the picture would take its place.
    const member = { member: 1, own: false, groomKey: "a", groom, pose: rigidPose(), lattice: null };
    const hair = new HairScene({ sample: () => [member, member] }, renderer);
    const camera = new PerspectiveCamera(35, 4 / 3);
    camera.position.z = 2;
    do {
      await new Promise((done) => setTimeout(done, 1));
      hair.update(camera);
    } while (!hair.characters.get(1)?.isReady);
    expect(hair.statistics.characters).toBe(1);
    hair.dispose();
  });

  test("frames characters as soon as they have arrived, and again until each can be drawn", async () => {
    const members: ShownMember[] = [];
    const hair = new HairScene({ sample: () => members }, renderer);
    const camera = new PerspectiveCamera(35, 4 / 3);
    // The x of each place at which the camera was pointed.
    const centres: number[] = [];
    hair.addEventListener("framed", ({ centre }) => centres.push(centre.x));
    // `frame` is called while the room is empty, as a page calls it at its start. The camera waits.
    hair.frame(camera);
    hair.update(camera);
    expect(camera.position.length()).toBe(0);
    const join = (member: number, x: number) =>
      members.push({
        member,
        own: false,
        groomKey: "a",
        groom,
        pose: rigidPose([0, 0, 0, 1], [x, 0, 0]),
        lattice: null,
      });
    join(1, 1);
    hair.update(camera);
    join(2, 3);
    hair.update(camera);
    // The first picture centres on the one character at x = 1; the second centres between x = 1 and x = 3.
    expect(centres).toEqual([expect.closeTo(1), expect.closeTo(2)]);
    const isDone = () => [...hair.characters.values()].every((one) => one.isReady);
    for (; !isDone(); hair.update(camera)) await new Promise((done) => setTimeout(done, 1));
    const count = centres.length;
    join(3, 9);
    hair.update(camera);
    // The request of `frame` has ended with the first picture in which all could be drawn, so a late joiner moves no
    // camera.
    expect(centres.length).toBe(count);
    hair.frame(camera, { member: 3 });
    expect(centres.at(-1)).toBeCloseTo(9);
    hair.dispose();
  });
});
