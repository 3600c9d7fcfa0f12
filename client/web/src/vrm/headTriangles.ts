import type { VRM } from "@pixiv/three-vrm";
import { Matrix4, SkinnedMesh, Vector3, type Mesh, type Object3D } from "three";
import type { Groom } from "../hair/groom";
import type { Triangles } from "./headSurface";
import { isBelow } from "./isBelow";
import { cornersOf, heaviest, meshesOf, namesOf } from "./vrmMeshes";
import { atRest } from "./vrmSkeleton";

/** Things on a head that are no part of the skull. */
const kWornName = /hat|cap(?!e)|helmet|hood|glasses|goggles|horn|ribbon|hair_?band|head_?phone|crown|halo|antenna/i;

/** The part of the groom's own body that moves with the head: triangles with a weight of the head above 0.9. */
export function groomHeadTriangles({ body }: Pick<Groom, "body">): Triangles {
  const out: number[] = [];
  for (let t = 0; t < body.triangles.length; t += 3) {
    const corners = [...body.triangles.subarray(t, t + 3)];
    if (!corners.every((v) => body.boneWeights[5 * v] > 0.9)) continue;
    for (const v of corners) out.push(...body.vertices.subarray(3 * v, 3 * v + 3));
  }
  return out;
}

/**
 * The triangles of the model's meshes that belong to the head bone, at rest, in the axes of `anchor`. `hidden` meshes,
 * triangles of `hairBones`, and things on the head such as hats (`isWorn`) are left out.
 */
export function modelHeadTriangles(
  vrm: VRM,
  anchor: Object3D,
  hidden: readonly Mesh[],
  hairBones: ReadonlySet<Object3D>,
): Triangles {
  return atRest(vrm, () => {
    const toHead = anchor.matrixWorld.clone().invert();
    return meshesOf(vrm)
      .filter((mesh) => !hidden.includes(mesh) && !isWorn(mesh))
      .flatMap((mesh) => headTriangles(vrm, mesh, toHead, hairBones));
  });
}

/** Whether a mesh is named as a thing that is worn on the head. */
export function isWorn(mesh: Mesh): boolean {
  return namesOf(mesh).some((name) => kWornName.test(name));
}

/**
 * The triangles of one mesh that belong to the head. The model must be at rest. `toHead`: from the world to head space.
 */
export function headTriangles(
  vrm: VRM,
  mesh: Mesh,
  toHead: Matrix4,
  hairBones: ReadonlySet<Object3D> = new Set(),
): number[] {
  const head = vrm.humanoid.getRawBoneNode("head");
  if (!(mesh instanceof SkinnedMesh) && !isBelow(mesh, head)) return [];
  const isOfHead = (v: number) => {
    if (!(mesh instanceof SkinnedMesh)) return true;
    const bone = mesh.skeleton.bones[heaviest(mesh, v)];
    return isBelow(bone, head) && !hairBones.has(bone);
  };
  const corners = cornersOf(mesh);
  const move = new Matrix4().multiplyMatrices(toHead, mesh.matrixWorld);
  const out: number[] = [];
  const at = new Vector3();
  for (let t = 0; t < corners.length; t += 3) {
    const triangle = corners.subarray(t, t + 3);
    if (!triangle.every(isOfHead)) continue;
    for (const v of triangle) out.push(...mesh.getVertexPosition(v, at).applyMatrix4(move).toArray());
  }
  return out;
}
