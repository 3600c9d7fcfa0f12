import type { VRM } from "@pixiv/three-vrm";
import { Mesh, SkinnedMesh, type Material, type Object3D } from "three";
import { isBelow } from "./isBelow";

const kHairName = /hair|bangs|fringe|ponytail|pigtail|twintail|ahoge|kami|\u9aea|\u30d8\u30a2/i;
/** Names that are not hair, even if they contain other words for hair. */
const kOtherName = /hairband|hair_?pin|hair_?clip|ribbon|eyebrow|eyelash|brow|lash|ear(?!th)/i;
const kShareOfHairBones = 0.6;

/**
 * The meshes of a model's own hair: by their name or their material's, or because most of their vertices belong to
 * bones that are named as hair or swing under the head as spring bones.
 */
export function findHairMeshes(vrm: VRM): Mesh[] {
  const bones = hairBones(vrm);
  const found: Mesh[] = [];
  vrm.scene.traverse((object) => {
    if (!(object instanceof Mesh)) return;
    const materials: Material[] = Array.isArray(object.material) ? object.material : [object.material];
    const names = [object.name, ...materials.map((material) => material.name)];
    if (names.some((name) => kOtherName.test(name))) return;
    const named = names.some((name) => kHairName.test(name));
    if (named || (object instanceof SkinnedMesh && shareOf(object, bones) > kShareOfHairBones)) found.push(object);
  });
  return found;
}

function hairBones(vrm: VRM): Set<Object3D> {
  const bones = new Set<Object3D>();
  const head = vrm.humanoid.getRawBoneNode("head");
  const human = new Set(Object.values(vrm.humanoid.rawHumanBones).map((bone) => bone?.node));
  vrm.scene.traverse((object) => {
    if (kHairName.test(object.name) && !kOtherName.test(object.name) && !human.has(object)) bones.add(object);
  });
  for (const joint of vrm.springBoneManager?.joints ?? []) {
    if (isBelow(joint.bone, head) && !kOtherName.test(joint.bone.name)) joint.bone.traverse((bone) => bones.add(bone));
  }
  return bones;
}

/** The share of a mesh's vertices whose heaviest bone is one of `bones`. */
function shareOf(mesh: SkinnedMesh, bones: Set<Object3D>): number {
  const { skinIndex, skinWeight } = mesh.geometry.attributes;
  if (!skinIndex || !skinWeight || bones.size === 0) return 0;
  let count = 0;
  for (let v = 0; v < skinIndex.count; ++v) if (bones.has(mesh.skeleton.bones[heaviest(mesh, v)])) ++count;
  return count / Math.max(skinIndex.count, 1);
}

/** The index, in the skeleton, of a vertex's heaviest bone. */
export function heaviest(mesh: SkinnedMesh, vertex: number): number {
  const { skinIndex, skinWeight } = mesh.geometry.attributes;
  let best = 0;
  for (let i = 1; i < 4; ++i) if (skinWeight.getComponent(vertex, i) > skinWeight.getComponent(vertex, best)) best = i;
  return skinIndex.getComponent(vertex, best);
}
