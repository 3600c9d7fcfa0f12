import type { VRM, VRMHumanBoneName } from "@pixiv/three-vrm";
import { Matrix4, Object3D, Quaternion, Vector3 } from "three";
import { HairnetError } from "../module/hairnetError";
import { Bone, kBoneCount, kNumbersPerBone, kPoseNumbers, type Pose } from "../hair/pose";

/** The model's bones that serve as ours; the first existing one is used. */
const kBonesFor: Record<Bone, readonly VRMHumanBoneName[]> = {
  [Bone.head]: ["head"],
  [Bone.neck]: ["neck", "head"],
  [Bone.leftShoulder]: ["leftShoulder", "upperChest", "chest", "spine", "hips"],
  [Bone.rightShoulder]: ["rightShoulder", "upperChest", "chest", "spine", "hips"],
  [Bone.upperTrunk]: ["upperChest", "chest", "spine", "hips"],
};

/**
 * A model's head, neck, shoulders and upper chest as the five bones of a pose. The model may be in any pose: the
 * constructor resets it to rest, measures, and restores it.
 */
export class VrmSkeleton {
  /**
   * A child of the head bone with the axes of head space: its origin is the head joint, +Y up, +Z out of the face when
   * the model is at rest.
   */
  readonly anchor = new Object3D();
  /** The model's node for each bone of a pose, in the order of `Bone`. */
  readonly #nodes: Object3D[];
  /** The transform from head space, with its origin at the joint, to the head bone's own axes. */
  readonly #anchorAtJoint: Matrix4;
  /** The translation of the anchor from the head joint, head space. */
  readonly #offset = new Matrix4();
  /** For each bone's node at rest, the transform to the head joint's place with head space's axes. */
  readonly #restInHead: Matrix4[];

  constructor(readonly vrm: VRM) {
    this.#nodes = nodesOf(vrm);
    const { rest, head } = atRest(vrm, () => {
      const toModel = vrm.scene.matrixWorld.clone().invert();
      return {
        rest: this.#nodes.map((node) => toModel.clone().multiply(node.matrixWorld)),
        head: headSpace(vrm).premultiply(toModel),
      };
    });
    const toHead = head.clone().invert();
    this.#restInHead = rest.map((node) => toHead.clone().multiply(node));
    // Head space in the head bone, for any axes of the bone.
    this.#anchorAtJoint = rest[Bone.head].clone().invert().multiply(head);
    this.setAnchor([0, 0, 0], 1);
    this.anchor.name = "hairnet anchor";
    this.#nodes[Bone.head].add(this.anchor);
  }

  /** Moves the anchor's origin from the head joint (m, head space) and scales it. */
  setAnchor(offset: readonly [number, number, number], size: number): void {
    this.#offset.makeTranslation(...offset);
    moved.copy(this.#offset).scale(scale.setScalar(size)).premultiply(this.#anchorAtJoint);
    moved.decompose(this.anchor.position, this.anchor.quaternion, this.anchor.scale);
  }

  /** The place of a bone's joint in head space at rest, in metres of the model. */
  joint(bone: Bone, out = new Vector3()): Vector3 {
    return out.setFromMatrixPosition(this.#restInHead[bone]);
  }

  /**
   * The current pose of the model in the world (updates its world matrices), for a groom at the anchor. If the anchor
   * scales the groom up, the other bones move closer to the head by the same factor, to the groom's own distances.
   */
  pose(out: Pose = new Float64Array(kPoseNumbers)): Pose {
    this.anchor.updateWorldMatrix(true, false);
    this.anchor.matrixWorld.decompose(headPosition, rotation, scale);
    // three.js puts the mirror of a mirrored matrix into the scale of x.
    const size = Math.abs(scale.x);
    for (let bone = 0; bone < kBoneCount; ++bone) {
      const node = this.#nodes[bone];
      node.updateWorldMatrix(true, false);
      // From the groom's head space at rest to the world.
      moved.copy(this.#restInHead[bone]).invert().premultiply(node.matrixWorld).multiply(this.#offset);
      moved.decompose(position, rotation, scale);
      rotation.normalize();
      position.sub(headPosition).divideScalar(size).add(headPosition);
      const at = bone * kNumbersPerBone;
      out.set([rotation.x, rotation.y, rotation.z, rotation.w, position.x, position.y, position.z], at);
    }
    return out;
  }

  dispose(): void {
    this.anchor.removeFromParent();
  }
}

const moved = new Matrix4();
const position = new Vector3();
const headPosition = new Vector3();
const rotation = new Quaternion();
const scale = new Vector3();

function nodesOf(vrm: VRM): Object3D[] {
  return Array.from({ length: kBoneCount }, (_, bone) => {
    for (const name of kBonesFor[bone as Bone]) {
      const node = vrm.humanoid.getRawBoneNode(name);
      if (node) return node;
    }
    throw new HairnetError("invalid", `the model has no ${kBonesFor[bone as Bone][0]} bone`);
  });
}

/**
 * From head space to the world, of a model at rest: the origin is the head joint. Models of VRM 0 look along -Z of
 * their own space, those of VRM 1 along +Z.
 */
export function headSpace(vrm: VRM): Matrix4 {
  const joint = new Vector3().setFromMatrixPosition(vrm.humanoid.getRawBoneNode("head")!.matrixWorld);
  const facing = new Matrix4().makeRotationY(vrm.meta.metaVersion === "0" ? Math.PI : 0);
  return new Matrix4().extractRotation(vrm.scene.matrixWorld).multiply(facing).setPosition(joint);
}

/** Runs `measure` with the model at rest; then restores its pose. */
export function atRest<T>(vrm: VRM, measure: () => T): T {
  const nodes = Object.values(vrm.humanoid.rawHumanBones).flatMap((bone) => (bone ? [bone.node] : []));
  const kept = nodes.map((node) => ({ position: node.position.clone(), quaternion: node.quaternion.clone() }));
  vrm.humanoid.resetRawPose();
  updateMatrices(vrm);
  try {
    return measure();
  } finally {
    nodes.forEach((node, n) => {
      node.position.copy(kept[n].position);
      node.quaternion.copy(kept[n].quaternion);
    });
    updateMatrices(vrm);
  }
}

// `updateMatrixWorld` also updates what skinned meshes derive from their matrix; `updateWorldMatrix` does not.
function updateMatrices({ scene }: VRM): void {
  scene.updateWorldMatrix(true, false);
  scene.updateMatrixWorld(true);
}
