import { VRMLoaderPlugin, type VRM } from "@pixiv/three-vrm";
import { Quaternion, Vector3 } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { beforeEach, describe, expect, test } from "vitest";
import { makeMinimalVrm } from "../../page/minimalVrm";
import { Bone, kNumbersPerBone, poseFault, type Pose } from "../../src/hair/pose";
import { HairCharacter } from "../../src/scene/hairCharacter";
import { fitHead, findHairMeshes, VrmHair, VrmSkeleton } from "../../src/vrm/index";
import { madeGroom } from "../support/madeGroom";

async function load(): Promise<VRM> {
  const loader = new GLTFLoader().register((parser) => new VRMLoaderPlugin(parser));
  const { userData } = await loader.parseAsync(makeMinimalVrm(), "");
  return userData.vrm as VRM;
}

const headJoint = new Vector3(0, 1.53, 0); // of the minimal model

function moved(pose: Pose, bone: Bone, rest: Vector3): Vector3 {
  const at = bone * kNumbersPerBone;
  return rest
    .clone()
    .applyQuaternion(new Quaternion(pose[at], pose[at + 1], pose[at + 2], pose[at + 3]))
    .add(new Vector3(pose[at + 4], pose[at + 5], pose[at + 6]));
}

let vrm: VRM;
beforeEach(async () => {
  vrm = await load();
});

test("the minimal model is a VRM with the bones that hair needs, and its own hair", () => {
  for (const bone of ["head", "neck", "leftShoulder", "rightShoulder", "upperChest"] as const)
    expect(vrm.humanoid.getRawBoneNode(bone)).not.toBeNull();
  expect(findHairMeshes(vrm).map((mesh) => mesh.name)).toEqual(["Hair"]);
});

test("hair is found by the bones it hangs on, too", () => {
  const [hair] = findHairMeshes(vrm);
  hair.name = "Mesh_7";
  for (const material of [hair.material].flat()) material.name = "Material_3";
  // Only its tail belongs to the spring bone: the cap alone would belong to the head.
  const { skinIndex } = hair.geometry.attributes;
  const tail = vrm.scene.getObjectByName("hair_tail");
  const index = (hair as unknown as { skeleton: { bones: unknown[] } }).skeleton.bones.indexOf(tail);
  expect(findHairMeshes(vrm)).toEqual([]);
  for (let v = 0; v < skinIndex.count; ++v) skinIndex.setX(v, index);
  expect(findHairMeshes(vrm)).toEqual([hair]);
});

describe("a model's skeleton as a pose", () => {
  test("at rest has all bones equal: head space at the head joint, facing where the model does", () => {
    const pose = new VrmSkeleton(vrm).pose();
    expect(poseFault(pose)).toBeNull();
    for (let bone = 0; bone < 5; ++bone) {
      const at = bone * kNumbersPerBone;
      expect([...pose.subarray(at, at + 3)].every((x) => Math.abs(x) < 1e-6)).toBe(true);
      expect([...pose.subarray(at + 4, at + 7)]).toEqual(headJoint.toArray().map((x) => expect.closeTo(x, 5)));
    }
  });

  test("is the same whatever the model did before", () => {
    vrm.humanoid.getRawBoneNode("neck")!.rotation.set(0.4, 0.6, 0.1);
    vrm.humanoid.getRawBoneNode("head")!.rotation.set(-0.3, 0.2, 0.5);
    const skeleton = new VrmSkeleton(vrm);
    const turned = skeleton.pose();
    expect(Math.abs(turned[1])).toBeGreaterThan(0.1);
    vrm.humanoid.resetRawPose();
    const pose = skeleton.pose();
    for (let bone = 0; bone < 5; ++bone) expect(pose[bone * kNumbersPerBone + 3]).toBeCloseTo(1, 6);
  });

  test("turns the neck about the neck's joint and leaves the trunk", () => {
    const skeleton = new VrmSkeleton(vrm);
    const neckJoint = skeleton.joint(Bone.neck);
    expect(neckJoint.y).toBeCloseTo(-0.09, 5);
    vrm.humanoid.getRawBoneNode("neck")!.rotation.y = 0.5;
    const pose = skeleton.pose();
    expect(moved(pose, Bone.neck, neckJoint).distanceTo(neckJoint.clone().add(headJoint))).toBeLessThan(1e-5);
    expect(pose[Bone.upperTrunk * kNumbersPerBone + 1]).toBeCloseTo(0, 6);
    expect(pose[Bone.head * kNumbersPerBone + 1]).toBeCloseTo(Math.sin(0.25), 5);
  });

  test("goes with a model that is moved and turned", () => {
    const skeleton = new VrmSkeleton(vrm);
    vrm.scene.position.set(3, 0, -1);
    vrm.scene.rotation.y = 1;
    const pose = skeleton.pose();
    expect(pose[1]).toBeCloseTo(Math.sin(0.5), 5);
    const head = headJoint.clone().applyMatrix4(vrm.scene.matrixWorld);
    expect(moved(pose, Bone.head, new Vector3()).distanceTo(head)).toBeLessThan(1e-5);
  });

  test("of a VRM 0 model looks the other way", () => {
    (vrm.meta as { metaVersion: string }).metaVersion = "0";
    const pose = new VrmSkeleton(vrm).pose();
    expect(Math.abs(pose[1])).toBeCloseTo(1, 5); // half a turn
  });

  test("bones that a model lacks are stood in for by those it has", () => {
    for (const bone of ["neck", "leftShoulder", "rightShoulder", "upperChest"] as const)
      delete vrm.humanoid.humanBones[bone];
    expect(vrm.humanoid.getRawBoneNode("neck")).toBeNull();
    const skeleton = new VrmSkeleton(vrm);
    vrm.humanoid.getRawBoneNode("chest")!.rotation.y = 0.3;
    vrm.humanoid.getRawBoneNode("head")!.rotation.x = 0.4;
    const pose = skeleton.pose();
    expect(poseFault(pose)).toBeNull();
    const of = (bone: Bone) => [...pose.subarray(bone * kNumbersPerBone, (bone + 1) * kNumbersPerBone)];
    expect(of(Bone.neck)).toEqual(of(Bone.head));
    expect(of(Bone.leftShoulder)).toEqual(of(Bone.upperTrunk));
    expect(of(Bone.rightShoulder)).toEqual(of(Bone.upperTrunk));
    const chest = [0, Math.sin(0.15), 0, Math.cos(0.15)];
    expect(of(Bone.upperTrunk).slice(0, 4)).toEqual(chest.map((x) => expect.closeTo(x, 5)));
    expect(of(Bone.head)[0]).toBeCloseTo(Math.sin(0.2) * Math.cos(0.15), 5);
  });
});

describe("hair on a model", () => {
  test("fits a head of another size: skulls as wide, crowns together", () => {
    const worn = new VrmHair(vrm);
    const fit = fitHead(madeGroom(), vrm, worn.skeleton.anchor, worn.hiddenMeshes);
    // Half axes 0.085 and 0.105 about 0.085 here, 0.08 and 0.1 about 0.08 there; cut at the same share of the height.
    expect(fit.size).toBeGreaterThan(1.02);
    expect(fit.size).toBeLessThan(1.1);
    expect(fit.offset[1] + fit.size * 0.2).toBeCloseTo(0.21, 2);
  });

  test("sends poses whose other bones lie as the groom's own, and draws them as large as the model", () => {
    const worn = new VrmHair(vrm, { headFit: { size: 1.25, offset: [0, 0.01, 0] } });
    vrm.humanoid.getRawBoneNode("head")!.rotation.x = 0.4;
    const pose = worn.pose();
    expect(poseFault(pose)).toBeNull();
    worn.skeleton.anchor.updateWorldMatrix(true, false);
    const origin = new Vector3().setFromMatrixPosition(worn.skeleton.anchor.matrixWorld);
    expect(moved(pose, Bone.head, new Vector3()).distanceTo(origin)).toBeLessThan(1e-5);
    // The trunk's transform, enlarged about the head again, leaves the model's chest where it is.
    const chest = vrm.humanoid.getRawBoneNode("upperChest")!.getWorldPosition(new Vector3());
    const rest = chest
      .clone()
      .sub(headJoint)
      .sub(new Vector3(0, 0.01, 0))
      .divideScalar(1.25);
    const drawn = moved(pose, Bone.upperTrunk, rest).sub(origin).multiplyScalar(1.25).add(origin);
    expect(drawn.distanceTo(chest)).toBeLessThan(1e-4);
  });

  test("hides the model's own and the groom's bust, and gives both back", () => {
    const [hair] = findHairMeshes(vrm);
    const character = new HairCharacter(1, true, "");
    const worn = new VrmHair(vrm);
    worn.wear(character);
    expect(hair.visible).toBe(false);
    expect(character.bodyVisible).toBe(false);
    expect(character.anchor).toBe(worn.skeleton.anchor);
    const head = vrm.humanoid.getRawBoneNode("head")!;
    expect(worn.skeleton.anchor.parent).toBe(head);
    worn.dispose();
    expect(hair.visible).toBe(true);
    expect(character.bodyVisible).toBe(true);
    expect(character.anchor).toBeNull();
    expect(worn.skeleton.anchor.parent).toBeNull();
  });

  test("the anchor looks out of the face whatever axes the head bone has", () => {
    // As exporters write them: bones at rest have their own axes.
    const head = vrm.humanoid.getRawBoneNode("head")!;
    head.quaternion.setFromAxisAngle(new Vector3(1, 2, 3).normalize(), 1.2);
    vrm.humanoid.rawRestPose.head!.rotation = head.quaternion.toArray();
    const skeleton = new VrmSkeleton(vrm);
    head.quaternion.premultiply(new Quaternion().setFromAxisAngle(new Vector3(0, 1, 0), 0.7));
    skeleton.anchor.updateWorldMatrix(true, false);
    const along = (axis: Vector3) => axis.transformDirection(skeleton.anchor.matrixWorld).toArray();
    expect(along(new Vector3(0, 0, 1))).toEqual([Math.sin(0.7), 0, Math.cos(0.7)].map((x) => expect.closeTo(x, 5)));
    expect(along(new Vector3(0, 1, 0))).toEqual([0, 1, 0].map((x) => expect.closeTo(x, 5)));
  });
});
