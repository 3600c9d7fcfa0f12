import { type BufferGeometry, type Material, Mesh, Scene, Vector3 } from "three";
import { expect, test } from "vitest";
import { Mirror } from "../../../page/play/mirror";

test("a disposed mirror leaves the scene, and gives back the memory of its glass and its frame", () => {
  const mirror = new Mirror(new Vector3(0, 1.6, 0), 0);
  const scene = new Scene().add(mirror);
  const held = new Set<BufferGeometry | Material>();
  mirror.traverse((object) => {
    if (!(object instanceof Mesh)) return;
    for (const one of [object.geometry as BufferGeometry, object.material as Material]) {
      held.add(one);
      one.addEventListener("dispose", () => held.delete(one));
    }
  });
  // The glass and the frame each have a geometry and a material.
  expect(held.size).toBe(4);
  mirror.dispose();
  expect(held.size).toBe(0);
  expect(scene.children).toEqual([]);
});
