// Compares strands on the GPU with those of a world that C++ simulates (hairnet_shown_points).
import { Quaternion, Vector3 } from "three";
import { afterAll, beforeAll, expect, test } from "vitest";
import { nodeCount } from "../src/hair/movedLattice";
import { Bone, kNumbersPerBone, kPoseNumbers, rigidPose, type Pose } from "../src/hair/pose";
import { ModuleLattice, Scene } from "../src/room/shown";
import { localModule, strandsFile } from "../test/support/grooms";
import { Browser } from "./browser";
import type { HairNow, Limits, placeStrands } from "./deformPage";
import { StageServer } from "./stageServer";

/** GPU and C++ compute the same in floats: 10 um are rounding, on coordinates of some 0.1 m. */
const kWithinM = 1e-5;

const browser = new Browser();
let server: StageServer | undefined;
beforeAll(async () => {
  await browser.start();
  server = await StageServer.open(browser, "deformPage");
});
afterAll(async () => {
  await browser.dispose();
  await server?.dispose();
});

/** The pose at `s` seconds: the character moves forward and up, and the head alone turns. */
function poseAt(s: number): Pose {
  const pose = rigidPose([0, 0, 0, 1], [0, 0.4 * s, 1.5 * s]);
  pose.set([0, Math.sin(s), 0, Math.cos(s)], Bone.head * kNumbersPerBone);
  return pose;
}

/** The key of a point is its place at rest: GPU and C++ have points in different orders. */
const nameOf = (numbers: ArrayLike<number>, at: number) => [numbers[at], numbers[at + 1], numbers[at + 2]].join();

/** Hair in the middle of a motion, and where C++ places its points, head space, m, by their names. */
async function movingHair(): Promise<{ hair: HairNow; placed: Map<string, Vector3> }> {
  const module = await localModule();
  // Of strands with fewer points, more are drawn.
  const file = await strandsFile(40, 48);
  const groom = module.makeOf("hairnet_groom_load", file);
  const levels = module.make("hairnet_build_finish", module.make("hairnet_build_begin", groom));
  const world = module.make("hairnet_world_make", 60);
  const bytesAt = (s: number) => new Uint8Array(poseAt(s).buffer);
  const own = module.with(bytesAt(0), (at) => module.made("", "hairnet_world_add", world, groom, levels, 0, at));
  // After a third of a second of turning the hair lags behind the head, and some of it meets the skin.
  const endS = 1 / 3;
  for (let s = 0; s < endS; s += 1 / 60) {
    module.with(bytesAt(s), (at) => module.call("hairnet_world_push_pose", world, own, at, 0));
    module.call("hairnet_world_advance", world, 1 / 60);
  }

  const scene = new Scene(module, module.call("hairnet_world_scene", world), module);
  scene.read();
  const shown = scene.at(0);
  const pose = new Float64Array(kPoseNumbers);
  shown.readPose(pose);
  const { lattice } = new ModuleLattice(scene, shown, 0);
  const nodes = new Float32Array(3 * nodeCount(lattice));
  scene.nodesOf(0, nodes);
  const skin = scene.skinOf(0)!;
  const count = module.call("hairnet_groom_point_count", groom);
  const points = new Float32Array(3 * count);
  scene.pointsOf(0, points);
  const rest = module.floats(module.call("hairnet_groom_points", groom), points.length);
  const turn = new Quaternion().fromArray(pose).invert();
  const head = new Vector3().fromArray(pose, 4);
  const placed = new Map<string, Vector3>();
  for (let p = 0; p < points.length; p += 3)
    placed.set(nameOf(rest, p), new Vector3().fromArray(points, p).sub(head).applyQuaternion(turn));
  const plain = { ...lattice, origin: Array.from(lattice.origin), spacing: Array.from(lattice.spacing) };
  const travelling = { ...skin, nodes: [...skin.nodes] };
  return { hair: { file: [...file], pose: [...pose], lattice: plain, nodes: [...nodes], skin: travelling }, placed };
}

/** Runs in the page. */
function place([hair, limits]: [HairNow, Limits]): Promise<number[]> {
  return (window as unknown as { placeStrands: typeof placeStrands }).placeStrands(hair, limits);
}

test("the GPU places strands where C++ does, out of the skin and no longer than at rest", async () => {
  const { hair, placed } = await movingHair();
  /** The largest distance between a point on the GPU and the same point in C++, m. */
  const furthest = async (limits: Limits) => {
    const read = await server!.page.evaluate(place, [hair, limits] as [HairNow, Limits]);
    // Each point has 6 numbers: its place at rest, and where the GPU places it.
    expect(read.length).toBe(6 * placed.size);
    let furthestM = 0;
    for (let at = 0; at < read.length; at += 6) {
      const expected = placed.get(nameOf(read, at))!;
      furthestM = Math.max(furthestM, expected.distanceTo(new Vector3().fromArray(read, at + 3)));
    }
    return furthestM;
  };
  expect(await furthest({ skin: true, lengths: true })).toBeLessThan(kWithinM);
  // Without either limit points lie at least 1 mm off, so this motion does exercise both limits.
  expect(await furthest({ skin: false, lengths: true })).toBeGreaterThan(100 * kWithinM);
  expect(await furthest({ skin: true, lengths: false })).toBeGreaterThan(100 * kWithinM);
  expect(browser.takeErrors()).toEqual([]);
});
