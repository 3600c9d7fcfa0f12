import type { VRM } from "@pixiv/three-vrm";
import { SkinnedMesh, type BufferAttribute, type Matrix4, type Mesh, type Object3D } from "three";
import { HeadSurface, kScalp, middleOf } from "./headSurface";
import { headTriangles, isWorn } from "./headTriangles";
import { isBelow } from "./isBelow";
import { cornersOf, heaviest, meshesOf, namesOf } from "./vrmMeshes";
import { atRest, headSpace } from "./vrmSkeleton";

/** Names of hair. The escapes are Japanese: the character for hair (kami), and the English word in Katakana. */
const kHairName = /hair|bangs|fringe|ponytail|pigtail|twintail|ahoge|kami|\u9aea|\u30d8\u30a2/i;
/** Names that are not hair, even if they contain other words for hair. */
const kOtherName = /hairband|hair_?pin|hair_?clip|ribbon|eyebrow|eyelash|brow|lash|ear(?!th)/i;
/** A mesh is hair if a larger share of its triangles' corners than this belongs to bones of hair. */
const kShareOfHairBones = 0.6;
/** The share of the scalp that a mesh must cover, outside of another mesh, to be hair by its place. */
const kShareOfScalp = 0.6;

/**
 * The meshes of a model's own hair: by their name or their material's, because most of their triangles belong to bones
 * that are named as hair or swing under the head as spring bones, or because they lie as a second layer on the scalp.
 */
export function findHairMeshes(vrm: VRM): Mesh[] {
  const bones = findHairBones(vrm);
  const found = meshesOf(vrm).filter((mesh) => {
    const names = namesOf(mesh);
    if (names.some((name) => kOtherName.test(name))) return false;
    return names.some((name) => kHairName.test(name)) || shareOf(mesh, bones) > kShareOfHairBones;
  });
  return found.length > 0 ? found : atRest(vrm, () => coversOfScalp(vrm));
}

/** Bones of a model's own hair: named as hair, or spring bones under the head that are not named as something else. */
export function findHairBones(vrm: VRM): Set<Object3D> {
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

/**
 * Does not draw the triangles of a mesh that hang on `bones`. Returns a function that draws them again; null if there
 * are no such triangles.
 */
export function hideTriangles(mesh: Mesh, bones: ReadonlySet<Object3D>): (() => void) | null {
  const { geometry } = mesh;
  if (!(mesh instanceof SkinnedMesh) || !geometry.index) return null;
  const before = geometry.index;
  const after: BufferAttribute = before.clone();
  let count = 0;
  for (let t = 0; t + 2 < before.count; t += 3) {
    const corners = [0, 1, 2].map((n) => before.getX(t + n));
    if (!corners.some((v) => bones.has(mesh.skeleton.bones[heaviest(mesh, v)]))) continue;
    for (let n = 0; n < 3; ++n) after.setX(t + n, corners[0]);
    ++count;
  }
  if (count === 0) return null;
  geometry.setIndex(after);
  return () => geometry.setIndex(before);
}

/** The share of a mesh's triangles' corners whose heaviest bone is one of `bones`. */
function shareOf(mesh: Mesh, bones: ReadonlySet<Object3D>): number {
  if (!(mesh instanceof SkinnedMesh) || bones.size === 0) return 0;
  const corners = cornersOf(mesh);
  const count = corners.filter((v) => bones.has(mesh.skeleton.bones[heaviest(mesh, v)])).length;
  return count / Math.max(corners.length, 1);
}

/** Meshes outside of all others over most of the scalp. A face has expressions, and hair has none. */
function coversOfScalp(vrm: VRM): Mesh[] {
  const toHead: Matrix4 = headSpace(vrm).invert();
  const layers = meshesOf(vrm)
    .map((mesh) => ({ mesh, triangles: headTriangles(vrm, mesh, toHead) }))
    .filter(({ triangles }) => triangles.length > 0);
  const middle = middleOf(layers.flatMap(({ triangles }) => triangles));
  if (!middle) return [];
  const surfaces = layers.map(({ triangles }) => new HeadSurface(triangles, middle));
  return layers.flatMap(({ mesh }, n) => {
    if (isWorn(mesh) || mesh.geometry.morphAttributes.position) return [];
    const covered = kScalp.filter((direction) => {
      const under = Math.max(...surfaces.map((other, m) => (m === n ? 0 : other.radius(direction))));
      return under > 0 && surfaces[n].radius(direction) > under;
    });
    return covered.length > kShareOfScalp * kScalp.length ? [mesh] : [];
  });
}
