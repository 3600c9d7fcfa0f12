import type { Vector } from "./glb";

interface BoneSpec {
  readonly name: string;
  readonly parent: string | null;
  /** The place of the joint from that of the parent, m, in a model that looks along +Z. */
  readonly at: Vector;
}

const limbs = (side: 1 | -1, prefix: string): BoneSpec[] => [
  { name: `${prefix}Shoulder`, parent: "upperChest", at: [0.03 * side, 0.1, 0] },
  { name: `${prefix}UpperArm`, parent: `${prefix}Shoulder`, at: [0.1 * side, 0, 0] },
  { name: `${prefix}LowerArm`, parent: `${prefix}UpperArm`, at: [0.24 * side, 0, 0] },
  { name: `${prefix}Hand`, parent: `${prefix}LowerArm`, at: [0.23 * side, 0, 0] },
  { name: `${prefix}UpperLeg`, parent: "hips", at: [0.08 * side, -0.05, 0] },
  { name: `${prefix}LowerLeg`, parent: `${prefix}UpperLeg`, at: [0, -0.42, 0] },
  { name: `${prefix}Foot`, parent: `${prefix}LowerLeg`, at: [0, -0.42, 0] },
];

/** The bones of the made avatar, with the names of VRM. */
export const kBones: readonly BoneSpec[] = [
  { name: "hips", parent: null, at: [0, 0.95, 0] },
  { name: "spine", parent: "hips", at: [0, 0.1, 0] },
  { name: "chest", parent: "spine", at: [0, 0.12, 0] },
  { name: "upperChest", parent: "chest", at: [0, 0.13, 0] },
  { name: "neck", parent: "upperChest", at: [0, 0.14, -0.01] },
  { name: "head", parent: "neck", at: [0, 0.09, 0.01] },
  ...limbs(1, "left"),
  ...limbs(-1, "right"),
];

export function boneIndex(name: string): number {
  return kBones.findIndex((bone) => bone.name === name);
}

/** The place of a joint at rest, m. */
export function jointOf(name: string): Vector {
  const { parent, at } = kBones[boneIndex(name)];
  const from = parent ? jointOf(parent) : [0, 0, 0];
  return [from[0] + at[0], from[1] + at[1], from[2] + at[2]];
}
