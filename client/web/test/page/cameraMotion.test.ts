import { EventDispatcher, PerspectiveCamera, Vector3 } from "three";
import type { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { expect, test } from "vitest";
import { CameraMotion, type CameraView } from "../../page/cameraMotion";

/** The part of OrbitControls that moves nothing by itself. */
class Controls extends EventDispatcher<{ start: object }> {
  readonly target = new Vector3();
  readonly minDistance = 0.25;
  readonly maxDistance = 40;
  update(): void {}
}

function begin() {
  const camera = new PerspectiveCamera();
  const controls = new Controls();
  const motion = new CameraMotion(camera, controls as unknown as OrbitControls);
  // A bearing of 3 is almost behind the person; `there` has -3, which is 0.28 rad further that way and 6 rad the other
  // way.
  // `bearing` is about +Y from +Z and `height` above the horizontal, both in rad; `distance` is in m.
  motion.set({ target: new Vector3(0, 1.6, 0), bearing: 3, height: 0.1, distance: 4 });
  const run = (seconds: number, each = () => {}) => {
    for (let n = 0; n < 60 * seconds; ++n) {
      motion.update(1 / 60);
      each();
    }
  };
  return { camera, controls, motion, run };
}

const there: CameraView = { target: new Vector3(1, 1.5, 0.2), bearing: -3, height: 0.2, distance: 1 };

test("a flight goes the shorter way around, smoothly, and arrives", () => {
  const { camera, motion, run } = begin();
  motion.flyTo(there);
  let before = camera.position.clone();
  // A flight takes 1.3 s (kFlightS of cameraMotion.ts).
  run(0.1);
  expect(motion.isFlying).toBe(true);
  run(3, () => {
    // The flight has 78 pictures (1.3 s at 60 Hz), so 0.2 m in one of them would be a jump.
    expect(camera.position.distanceTo(before)).toBeLessThan(0.2);
    // The camera never comes in front of the faces (z above 0), which the longer way around would pass.
    expect(camera.position.z).toBeLessThan(0);
    before = camera.position.clone();
  });
  expect(motion.isFlying).toBe(false);
  expect(motion.view.target.distanceTo(there.target)).toBeLessThan(1e-6);
  expect(motion.view.distance).toBeCloseTo(1, 6);
  expect(Math.cos(motion.view.bearing - there.bearing)).toBeCloseTo(1, 6);
});

test("the user interrupts a flight and the slow orbit", () => {
  const { camera, controls, motion, run } = begin();
  motion.flyTo(there);
  motion.orbitSlowly(0.5);
  // After 0.5 s the flight of 1.3 s is under way. OrbitControls says "start" when the user drags.
  run(0.5);
  controls.dispatchEvent({ type: "start" });
  const stopped = camera.position.clone();
  run(3);
  expect(camera.position.distanceTo(stopped)).toBe(0);
});

test("the slow orbit stays within its swing, or goes all around", () => {
  const { motion, run } = begin();
  const { bearing } = motion.view;
  let most = 0;
  motion.orbitSlowly(0.5);
  // In 60 s the orbit covers 5.4 rad (kOrbitRadPerS is 0.09), enough to reach both ends.
  run(60, () => (most = Math.max(most, Math.acos(Math.cos(motion.view.bearing - bearing)))));
  // The orbit has come near its end of 0.5 rad, and has not passed it.
  expect(most).toBeGreaterThan(0.45);
  expect(most).toBeLessThanOrEqual(0.5 + 1e-6);
  motion.orbitSlowly(Infinity);
  most = 0;
  run(60, () => (most = Math.max(most, Math.acos(Math.cos(motion.view.bearing - bearing)))));
  // Half a turn (pi) is the largest angle from the first bearing, so 3 rad mean that the orbit passes behind.
  expect(most).toBeGreaterThan(3);
});

test("with reduced motion a flight arrives at once and nothing orbits", () => {
  const { camera, motion, run } = begin();
  motion.isReduced = true;
  motion.flyTo(there);
  expect(motion.view.distance).toBeCloseTo(1, 6);
  motion.orbitSlowly(Infinity);
  const still = camera.position.clone();
  run(2);
  expect(camera.position.distanceTo(still)).toBe(0);
});

test("keys zoom and turn; it ignores others", () => {
  const { motion } = begin();
  expect(motion.onKey("+")).toBe(true);
  expect(motion.view.distance).toBeLessThan(4);
  const { bearing } = motion.view;
  expect(motion.onKey("ArrowRight")).toBe(true);
  expect(motion.view.bearing).not.toBeCloseTo(bearing, 3);
  // 100 presses of 0.12 rad (kKeyTurnRad) would be two turns without a limit.
  for (let n = 0; n < 100; ++n) motion.onKey("ArrowUp");
  // Beyond the zenith the picture would turn over.
  expect(motion.view.height).toBeLessThan(Math.PI / 2);
  expect(motion.onKey("a")).toBe(false);
});

test("it follows a target that moves, also during a flight", () => {
  const { motion, run } = begin();
  motion.flyTo(there);
  const moved = new Vector3(-2, 1.4, 0);
  run(3, () => motion.follow(moved, 1 / 60));
  // The distance to a target decays by 2.5 a second (kFollow), so after some seconds less than 1 cm is left.
  expect(motion.view.target.distanceTo(moved)).toBeLessThan(0.01);
  const { distance, bearing } = motion.view;
  const further = new Vector3(-1, 1.4, 1);
  run(6, () => motion.follow(further, 1 / 60));
  expect(motion.view.target.distanceTo(further)).toBeLessThan(0.01);
  expect(motion.view.distance).toBeCloseTo(distance, 6);
  expect(motion.view.bearing).toBeCloseTo(bearing, 6);
});
