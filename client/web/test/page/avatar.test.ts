import { Vector3 } from "three";
import { describe, expect, test } from "vitest";
import { AvatarMotion } from "../../page/avatar/avatarMotion";
import { makeAvatar } from "../../scripts/avatar/madeAvatar";
import { kFitAsFound, RememberedFits } from "../../page/avatar/rememberedFits";
import { poseOf, rotationOf } from "../../page/head/headPose";
import { loadVrm, VrmSkeleton } from "../../src/vrm/index";

// GLTFLoader asks for the browser's global object.
(globalThis as { self?: unknown }).self ??= globalThis;

// The pose of a head at (1, 1.6, -2), turned by `yawRad` about +Y on a trunk that is turned by `bodyRad`.
const yaw = (yawRad: number, bodyRad = 0) =>
  poseOf(rotationOf({ yawRad, pitchRad: 0, rollRad: 0 }), [1, 1.6, -2], bodyRad);

for (const version of [0, 1] as const)
  describe(`a model of VRM ${version} as the user's body`, () => {
    test("stands with its head at the user's, and its hands below its shoulders", async () => {
      const vrm = await loadVrm(makeAvatar({ version }));
      const motion = new AvatarMotion(vrm);
      // The second argument is the time since the last picture, s.
      motion.update(yaw(0), 0.02);
      motion.root.updateMatrixWorld(true);
      const at = (bone: "head" | "leftHand" | "leftUpperArm") =>
        vrm.humanoid.getRawBoneNode(bone)!.getWorldPosition(new Vector3());
      expect(at("head").distanceTo(new Vector3(1, 1.6, -2))).toBeLessThan(0.02);
      // The arms of the made model are 0.47 m long (skeleton.ts), and hang almost vertically.
      expect(at("leftHand").y).toBeLessThan(at("leftUpperArm").y - 0.3);
      // The model looks along +Z, so its left hand is at a larger x than the head at x = 1.
      expect(at("leftHand").x).toBeGreaterThan(1.1);
    });

    test("turns its head with the user's, and its trunk with the user's trunk", async () => {
      const vrm = await loadVrm(makeAvatar({ version }));
      const skeleton = new VrmSkeleton(vrm);
      const motion = new AvatarMotion(vrm);
      for (let frame = 0; frame < 30; ++frame) motion.update(yaw(0.9, 0.4), 0.02);
      const pose = skeleton.pose();
      // The tolerance of 0.05 rad leaves room for breathing and looking around. A turn by an angle about +Y has the
      // sine of half the angle as its second number. The trunk is bone 4 of a pose, and each bone has 7 numbers.
      expect(2 * Math.asin(pose[1])).toBeCloseTo(0.9, 1);
      expect(2 * Math.asin(pose[4 * 7 + 1])).toBeCloseTo(0.4, 1);
      expect(Math.hypot(pose[0], pose[2])).toBeLessThan(0.03);
    });

    test("looks around and breathes while the user rests, and holds still in between", async () => {
      const vrm = await loadVrm(makeAvatar({ version }));
      const skeleton = new VrmSkeleton(vrm);
      const motion = new AvatarMotion(vrm);
      // In 30 s the head looks to both sides, by up to 0.4 rad (`wander` of avatarMotion.ts). This motion has its full
      // size 1.5 s after the user rests (kIdleReturnsS). Without it a resting avatar would look like a statue.
      let most = 0;
      let fastest = 0;
      let before = 0;
      for (let frame = 0; frame < 1500; ++frame) {
        motion.update(yaw(0), 1 / 50);
        const turned = 2 * Math.asin(skeleton.pose()[1]);
        most = Math.max(most, Math.abs(turned));
        fastest = Math.max(fastest, 50 * Math.abs(turned - before));
        before = turned;
      }
      expect(most).toBeGreaterThan(0.1);
      expect(most).toBeLessThan(0.6);
      // A head that looks around turns slower than 1 rad/s.
      expect(fastest).toBeLessThan(1);
    });
  });

describe("what the user set for a model", () => {
  const memory = () => {
    const values = new Map<string, string>();
    return {
      getItem: (key: string) => values.get(key) ?? null,
      setItem: (key: string, text: string) => void values.set(key, text),
    };
  };
  // The hair is 1.2 times as large as measured, 1 cm higher and 2 cm further back, and two meshes are hidden.
  const fit = { size: 1.2, height: 0.01, depth: -0.02, hidden: [0, 3] };

  test("is remembered by the hash of its file, and forgotten on request", () => {
    const storage = memory();
    const key = RememberedFits.keyOf(Uint8Array.of(1, 2, 3));
    expect(key).not.toBe(RememberedFits.keyOf(Uint8Array.of(1, 2, 4)));
    new RememberedFits(storage).put(key, fit);
    const fits = new RememberedFits(storage);
    expect(fits.get(key)).toEqual(fit);
    expect(fits.get("other")).toEqual(kFitAsFound);
    fits.forget(key);
    expect(fits.get(key)).toEqual(kFitAsFound);
  });

  test("is kept for the newest 32 files", () => {
    // The limit is kFilesMax of rememberedFits.ts.
    const fits = new RememberedFits(memory());
    for (let n = 0; n < 40; ++n) fits.put(`file ${n}`, fit);
    // Of 40 files the first 8 are forgotten.
    expect(fits.get("file 7")).toEqual(kFitAsFound);
    expect(fits.get("file 8")).toEqual(fit);
  });

  test("survives a storage with anything in it, one that is full, and none", () => {
    // The texts are no JSON, JSON of another shape, and entries with values that no control has.
    const wrong = ["", "{", "7", "null", '{"a":1}', '[1,null,{"key":3}]', '[{"key":"k","fit":{"size":-1}}]'];
    const far = { ...fit, height: 1e9 };
    for (const text of [
      ...wrong,
      JSON.stringify([{ key: "k", fit: far }]),
      JSON.stringify([{ key: "k", fit: { ...fit, hidden: ["a"] } }]),
    ])
      expect(new RememberedFits({ getItem: () => text, setItem: () => {} }).get("k")).toEqual(kFitAsFound);
    const full = {
      getItem: () => null,
      setItem: () => {
        throw new Error("QuotaExceededError");
      },
    };
    new RememberedFits(full).put("k", fit);
    expect(new RememberedFits(null).get("k")).toEqual(kFitAsFound);
  });
});
