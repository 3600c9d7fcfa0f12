// Strands on the GPU beside those of a world that C++ simulates (hairnet_shown_points).
import { Quaternion, Vector3 } from "three";
import { afterAll, beforeAll, expect, test } from "vitest";
import { nodeCount } from "../src/hair/movedLattice";
import { Bone, kNumbersPerBone, kPoseNumbers, rigidPose, type Pose } from "../src/hair/pose";
import { ModuleLattice, Scene } from "../src/room/shown";
import { localModule, strandsFile } from "../test/support/grooms";
import { Browser } from "./browser";
import type { HairNow, Limits, placeStrands } from "./deformPage";
import { StageServer } from "./stageServer";

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

/** Moves forward and up, and turns the head alone. */
function poseAt(s: number): Pose {
  const pose = rigidPose([0, 0, 0, 1], [0, 0.4 * s, 1.5 * s]);
  pose.set([0, Math.sin(s), 0, Math.cos(s)], Bone.head * kNumbersPerBone);
  return pose;
}

/** A point's name: where it is at rest. */
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
  /** m, of the point that is furthest from where C++ has it */
  const furthest = async (limits: Limits) => {
    const read = await server!.page.evaluate(place, [hair, limits] as [HairNow, Limits]);
    expect(read.length).toBe(6 * placed.size);
    let furthestM = 0;
    for (let at = 0; at < read.length; at += 6) {
      const expected = placed.get(nameOf(read, at))!;
      furthestM = Math.max(furthestM, expected.distanceTo(new Vector3().fromArray(read, at + 3)));
    }
    return furthestM;
  };
  expect(await furthest({ skin: true, lengths: true })).toBeLessThan(kWithinM);
  // Here both count.
  expect(await furthest({ skin: false, lengths: true })).toBeGreaterThan(100 * kWithinM);
  expect(await furthest({ skin: true, lengths: false })).toBeGreaterThan(100 * kWithinM);
  expect(browser.takeFaults()).toEqual([]);
});
