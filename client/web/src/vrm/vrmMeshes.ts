import type { VRM } from "@pixiv/three-vrm";
import { Mesh, type SkinnedMesh } from "three";

/** All meshes of a model, in the order of its scene. */
export function meshesOf(vrm: VRM): Mesh[] {
  const meshes: Mesh[] = [];
  vrm.scene.traverse((object) => {
    if (object instanceof Mesh) meshes.push(object);
  });
  return meshes;
}

/** The names of a mesh and its materials. */
export function namesOf(mesh: Mesh): string[] {
  return [mesh.name, ...[mesh.material].flat().map((material) => material.name)];
}

/** The index, in the skeleton, of a vertex's heaviest bone. */
export function heaviest(mesh: SkinnedMesh, vertex: number): number {
  const { skinIndex, skinWeight } = mesh.geometry.attributes;
  let best = 0;
  for (let i = 1; i < 4; ++i) if (skinWeight.getComponent(vertex, i) > skinWeight.getComponent(vertex, best)) best = i;
  return skinIndex.getComponent(vertex, best);
}

/** The vertices of a mesh's triangles, three a triangle. */
export function cornersOf({ geometry }: Mesh): Uint32Array {
  const { index, attributes, groups, drawRange } = geometry;
  const all = index?.count ?? attributes.position?.count ?? 0;
  // GLTFLoader makes a mesh of each primitive, which has one material, and no groups. Only outlines of toon materials
  // add groups: one for the material and one for the outline, both of all triangles.
  const { start, count } = groups[0] ?? drawRange;
  const end = Math.min(start + count, all);
  const corners = new Uint32Array(3 * Math.floor(Math.max(end - start, 0) / 3));
  for (let n = 0; n < corners.length; ++n) corners[n] = index ? index.getX(start + n) : start + n;
  return corners;
}
