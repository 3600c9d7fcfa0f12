import { type Mesh, Vector3 } from "three";
import { expect, test } from "vitest";
import { ShownHands } from "../../../page/touch/shownHands";
import type { Hand } from "../../../src/index";

const handOf = (shapes: Hand["shapes"]): Hand => ({
  firstNumber: 0,
  rotation: [0, 0, Math.SQRT1_2, Math.SQRT1_2],
  position: [0, 1, 0],
  shapes,
});
/** The box around what is drawn. */
function boxOf(mesh: Mesh) {
  mesh.updateMatrix();
  mesh.geometry.computeBoundingBox();
  return mesh.geometry.boundingBox!.clone().applyMatrix4(mesh.matrix);
}

test("a capsule is drawn around its line, and is gone with its hand", () => {
  const shown = new ShownHands();
  shown.show([handOf([{ from: [0.1, 0, 0], to: [0.2, 0, 0], radiusM: 0.01 }])]);
  expect(shown.children).toHaveLength(1);
  // The hand is turned by 90 degrees about z, so its x is the world's y.
  const { min, max } = boxOf(shown.children[0] as Mesh);
  expect(min.distanceTo(new Vector3(-0.01, 1.09, -0.01))).toBeLessThan(1e-3);
  expect(max.distanceTo(new Vector3(0.01, 1.21, 0.01))).toBeLessThan(1e-3);
  shown.show([]);
  expect(shown.children).toHaveLength(0);
});

test("what is no hand to look at is not drawn", () => {
  const shown = new ShownHands();
  const sphere = { from: [0, 0, 0], to: [0, 0, 0] } as const;
  shown.show([
    handOf([
      { ...sphere, radiusM: 0.02 },
      { ...sphere, radiusM: 0.02, isInsideOut: true },
      // Shapes beyond 0.15 m of radius or 0.5 m of length (kRadiusMaxM, kLengthMaxM of shownHands.ts) are not drawn,
      // and neither are those that keep hair within.
      { ...sphere, radiusM: 9 },
      { from: [0, 0, 0], to: [9, 0, 0], radiusM: 0.02 },
    ]),
  ]);
  expect(shown.children).toHaveLength(1);
});

test("hands of hundreds of sizes keep few geometries", () => {
  const shown = new ShownHands();
  let disposed = 0;
  const seen = new Set<unknown>();
  for (let mm = 1; mm < 500; ++mm) {
    shown.show([handOf([{ from: [0, 0, 0], to: [mm / 1000, 0, 0], radiusM: 0.01 }])]);
    const { geometry } = shown.children[0] as Mesh;
    if (!seen.has(geometry)) geometry.addEventListener("dispose", () => ++disposed);
    seen.add(geometry);
  }
  // A geometry is made for each length in mm; at most 256 are cached (kGeometriesMax).
  expect(seen.size - disposed).toBeLessThanOrEqual(256);
});

test("geometries that are in the picture stay, whatever comes beside them", () => {
  const shown = new ShownHands();
  const steady = { from: [0, 0, 0], to: [0, 0, 0], radiusM: 0.02 } as const;
  let disposed = 0;
  for (let mm = 1; mm < 500; ++mm) {
    shown.show([handOf([steady, { from: [0, 0, 0], to: [mm / 1000, 0, 0], radiusM: 0.01 }])]);
    if (mm === 1) (shown.children[0] as Mesh).geometry.addEventListener("dispose", () => ++disposed);
  }
  expect(disposed).toBe(0);
});
