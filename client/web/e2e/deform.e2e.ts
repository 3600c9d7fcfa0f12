// Strands on the GPU beside those of a world that C++ simulates (hairnet_shown_points).
import { Quaternion, Vector3 } from "three";
import { afterAll, beforeAll, expect, test } from "vitest";
import { Bone, kNumbersPerBone, rigidPose, type Pose } from "../src/hair/pose";
import type { Instance } from "../src/module/instance";
import { localModule, strandsFile } from "../test/support/grooms";
import { Browser } from "./browser";
import type { HairNow, Limits, placeStrands } from "./deformPage";
import { StageServer } from "./stageServer";

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

/** Hair in the middle of a motion, and its points, head space: 3 each, in the groom's order as those at rest. */
async function movingHair(): Promise<HairNow & { points: Float32Array; rest: Float32Array }> {
  const module = await localModule();
  const file = await strandsFile(60, 12);
  const groom = module.makeOf("hairnet_groom_load", file);
  const levels = module.make("hairnet_build_finish", module.make("hairnet_build_begin", groom));
  const world = module.make("hairnet_world_make", 60);
  const bytesOf = (pose: Pose) => new Uint8Array(pose.buffer);
  const own = module.with(bytesOf(poseAt(0)), (at) => module.make("hairnet_world_add", world, groom, levels, 0, at));
  let pose = poseAt(0);
  for (let tick = 1; tick <= 20; ++tick) {
    pose = poseAt(tick / 60);
    module.with(bytesOf(pose), (at) => module.call("hairnet_world_push_pose", world, own, at, 0));
    module.call("hairnet_world_advance", world, 1 / 60);
  }
  const scene = module.call("hairnet_world_scene", world);
  const count = module.call("hairnet_groom_point_count", groom);
  const lattice = readLattice(module, scene);
  const points = readFloats(module, 3 * count, (at) => module.call("hairnet_shown_points", scene, 0, at, 0, count));
  const turn = new Quaternion(pose[0], pose[1], pose[2], pose[3]).invert();
  const head = new Vector3(pose[4], pose[5], pose[6]);
  for (let p = 0; p < points.length; p += 3)
    new Vector3().fromArray(points, p).sub(head).applyQuaternion(turn).toArray(points, p);
  return {
    file: [...file],
    pose: [...pose],
    ...lattice,
    skin: readSkin(module, scene),
    points,
    rest: restOf(module, groom),
  };
}
