import { Group, PerspectiveCamera } from "three";
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import type { MemberImportance, ShownMember } from "../../src/hair/hairSource";
import { rigidPose } from "../../src/hair/pose";
import { HairScene } from "../../src/scene/hairScene";
import { idleRenderer } from "../support/idleRenderer";
import { someGroom } from "../support/grooms";

const groom = await someGroom();
const member: ShownMember = { member: 1, own: false, groomKey: "a", groom, pose: rigidPose(), lattice: null };

describe("numbers of a program that are not finite, or scales that hair cannot follow,", () => {
  const warn = vi.spyOn(console, "warn");
  let reported: readonly MemberImportance[] = [];
  let hair: HairScene;
  let camera: PerspectiveCamera;
  let nowMs = 0;

  beforeEach(async () => {
    warn.mockReset().mockImplementation(() => {});
    camera = new PerspectiveCamera(35, 1);
    camera.position.z = 2;
    const source = { sample: () => [member], reportImportance: (all: readonly MemberImportance[]) => (reported = all) };
    hair = new HairScene(source, idleRenderer);
    for (; !hair.characters.get(1)?.isReady; update()) await new Promise((done) => setTimeout(done, 1));
    expect(hair.statistics.characters).toBe(1);
  });
  afterEach(() => hair.dispose());

  function update(): void {
    // Pictures are a second apart by the clock of the scene; reports go by performance.now(), which tests hold still.
    nowMs += 1000;
    hair.updateAt(nowMs, camera);
  }

  // Each function makes one input of the scene not finite. None of them may throw in the program's render loop.
  const corruptions: Record<string, () => void> = {
    "a camera": () => camera.position.setX(NaN),
    "a camera's projection": () => {
      camera.aspect = NaN;
      camera.updateProjectionMatrix();
    },
    "the scene's place": () => hair.position.setY(Infinity),
    exposure: () => (hair.exposure = NaN),
    quality: () => (hair.quality = NaN),
    "a colour": () => hair.characters.get(1)!.hairColour.setRGB(NaN, 0, 0),
    roughness: () => (hair.characters.get(1)!.roughness = NaN),
    detail: () =>
      (hair.characters.get(1)!.detail = {
        strandShare: NaN,
        followHairCount: 0,
        toleranceM: 0,
        quadratic: 1,
      }),
    "an anchor": () => {
      const anchor = new Group();
      anchor.position.x = NaN;
      hair.characters.get(1)!.anchor = anchor;
    },
  };
  for (const [what, corrupt] of Object.entries(corruptions))
    test(`of ${what} end no update, are counted, and are told at most once a second`, () => {
      // Any time will do. It stands still, so both updates below are within one second of the first report.
      const clock = vi.spyOn(performance, "now").mockReturnValue(50_000);
      corrupt();
      update();
      const before = hair.statistics.inputsDropped;
      expect(before).toBeGreaterThan(0);
      update();
      expect(hair.statistics.inputsDropped).toBeGreaterThan(before);
      expect(warn).toHaveBeenCalledTimes(1);
      // More than a second after the first report the next one may follow.
      clock.mockReturnValue(51_001);
      update();
      expect(warn).toHaveBeenCalledTimes(2);
      clock.mockRestore();
      expect(warn.mock.calls[0][0]).toMatch(/^hairnet: [^\n]*(not finite|NaN)[^\n]* dropped/);
      // What is dropped here must not reach the server either. A comparison with NaN fails.
      for (const { screenHeight } of reported) expect(screenHeight).toBeGreaterThanOrEqual(0);
    });

  test("of the time reach nobody", () => {
    // The scene reports importance every 250 ms of this time (kImportanceEveryMs of hairScene.ts). Without a time there
    // is no report.
    for (let n = 0; n < 3; ++n) hair.updateAt(NaN, camera);
    reported = [];
    hair.updateAt(NaN, camera);
    expect(reported).toEqual([]);
  });

  test("hide the hair at a scale of 0, silently, until it is larger", () => {
    hair.scale.setScalar(0);
    update();
    expect(hair.statistics.characters).toBe(0);
    expect(reported).toEqual([{ member: 1, screenHeight: 0, inView: false }]);
    expect(warn).not.toHaveBeenCalled();
    // A scale of -1 mirrors the hair and draws it at its usual size.
    hair.scale.setScalar(-1);
    update();
    expect(hair.statistics.characters).toBe(1);
    expect(reported[0].inView).toBe(true);
  });

  test("are refused in one line, once, where the scale is uneven", () => {
    const parent = new Group();
    parent.scale.set(1, 2, 1);
    parent.add(hair);
    // The five updates are a second apart by the scene's clock. A line in each of them would flood the console.
    for (let n = 0; n < 5; ++n) update();
    expect(hair.statistics.characters).toBe(0);
    expect(warn).toHaveBeenCalledTimes(1);
    expect(warn.mock.calls[0][0]).toBe("hairnet: the HairScene's world matrix is scaled unevenly");
  });
});
