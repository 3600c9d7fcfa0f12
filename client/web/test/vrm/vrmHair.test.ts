import type { VRM } from "@pixiv/three-vrm";
import { Matrix4, Quaternion, type SkinnedMesh, Vector3 } from "three";
import { beforeEach, describe, expect, test } from "vitest";
import { makeAvatar, type MadeAvatarOptions } from "../../scripts/avatar/madeAvatar";
import { Bone, kNumbersPerBone, poseError, type Pose } from "../../src/hair/pose";
import { HairCharacter } from "../../src/scene/hairCharacter";
import { place, type Placed } from "../../src/scene/placement";
import { findHairMeshes, loadVrm, lowerArms, VrmHair, VrmSkeleton } from "../../src/vrm/index";
import { HeadSurface, kScalp } from "../../src/vrm/headSurface";
import { modelHeadTriangles } from "../../src/vrm/headTriangles";
import { madeGroom } from "../support/madeGroom";

// GLTFLoader asks for the browser's global object.
(globalThis as { self?: unknown }).self ??= globalThis;

const load = (options: MadeAvatarOptions = {}): Promise<VRM> => loadVrm(makeAvatar({ hairMesh: "Hair", ...options }));

/** The head joint of the made model at rest (client/web/scripts/avatar/skeleton.ts), m. */
const headJoint = new Vector3(0, 1.53, 0);

/** Where a point that hangs on the bone is in the world; `rest` is its place in head space at rest. */
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

test("the made model is a VRM with the bones that hair needs, and its own hair", () => {
  for (const bone of ["head", "neck", "leftShoulder", "rightShoulder", "upperChest"] as const)
    expect(vrm.humanoid.getRawBoneNode(bone)).not.toBeNull();
  expect(findHairMeshes(vrm).map((mesh) => mesh.name)).toEqual(["Hair"]);
});

// The page hides the hair that a model comes with. A mesh that is missed shows two hairstyles at once, and one that is
// taken for hair leaves the model without its hat or face.
describe("a model's own hair is found", () => {
  // Gives the hair mesh this name and its material one that says nothing, so that names alone cannot identify it.
  const rename = (name: string) => {
    const [hair] = findHairMeshes(vrm);
    hair.name = name;
    for (const material of [hair.material].flat()) material.name = "Material_3";
    return hair;
  };

  test("by its place: a second layer on the scalp", () => {
    const hair = rename("Mesh_7");
    expect(findHairMeshes(vrm)).toEqual([hair]);
  });

  test("but not by its place if its name is that of a hat", () => {
    rename("Top_Hat");
    expect(findHairMeshes(vrm)).toEqual([]);
  });

  test("and not if there is none", async () => {
    expect(findHairMeshes(await load({ hairMesh: undefined }))).toEqual([]);
  });

  test("by the bones that most of its triangles hang on", () => {
    const [hair] = findHairMeshes(vrm) as SkinnedMesh[];
    hair.name = "Top_Hat";
    for (const material of [hair.material].flat()) material.name = "Material_3";
    // The name is that of a hat, so only the bone can identify the mesh as hair.
    hangOnHairBone(hair, () => true);
    expect(findHairMeshes(vrm)).toEqual([hair]);
  });

  test("in a mesh with other things: only its triangles are hidden, and drawn again later", () => {
    const face = vrm.scene.getObjectByName("Face") as SkinnedMesh;
    const { geometry } = face;
    const before = geometry.index!;
    // The rings of the face go from the crown down: the first quarter of its vertices is the top of the head.
    const crown = geometry.attributes.position.count / 4;
    hangOnHairBone(face, (v) => v < crown);
    const vrmHair = new VrmHair(vrm);
    const drawn = geometry.index!;
    expect(drawn.count).toBe(before.count);
    let hidden = 0;
    for (let t = 0; t < drawn.count; t += 3) {
      const corners = [0, 1, 2].map((n) => before.getX(t + n));
      // A triangle with equal corners has no area, so nothing of it is drawn.
      const isHidden = drawn.getX(t) === drawn.getX(t + 1) && drawn.getX(t) === drawn.getX(t + 2);
      expect(isHidden).toBe(corners.some((v) => v < crown));
      if (isHidden) ++hidden;
    }
    expect(hidden).toBeGreaterThan(0);
    vrmHair.dispose();
    expect(geometry.index).toBe(before);
  });

  /**
   * Makes the chosen vertices follow a bone that is named as hair. The skeleton has no such bone, so the left hand
   * gives up its bone: bones of the humanoid never count as hair.
   */
  function hangOnHairBone(mesh: SkinnedMesh, which: (vertex: number) => boolean): void {
    const bone = mesh.skeleton.bones.find(({ name }) => name === "leftHand")!;
    bone.name = "hair_tail";
    delete (vrm.humanoid.humanBones as { leftHand?: unknown }).leftHand;
    const index = mesh.skeleton.bones.indexOf(bone);
    const { skinIndex, skinWeight } = mesh.geometry.attributes;
    for (let v = 0; v < skinIndex.count; ++v) {
      if (!which(v)) continue;
      skinIndex.setXYZW(v, index, 0, 0, 0);
      skinWeight.setXYZW(v, 1, 0, 0, 0);
    }
  }
});

for (const version of [0, 1] as const)
  describe(`a model of VRM ${version}`, () => {
    beforeEach(async () => {
      vrm = await load({ version });
    });

    test("has its version, and looks along +Z", () => {
      expect(vrm.meta.metaVersion).toBe(String(version));
      const pose = new VrmSkeleton(vrm).pose();
      expect(Math.abs(pose[3])).toBeCloseTo(1, 5);
      const foot = vrm.scene.getObjectByName("leftFoot")!.getWorldPosition(new Vector3());
      // A model that looks along +Z has its left side at +X.
      expect(foot.x).toBeGreaterThan(0);
    });

    test("lowers its arms: the hands are beside the hips, and the elbows bend forwards", () => {
      lowerArms(vrm);
      vrm.update(0.1);
      vrm.scene.updateWorldMatrix(true, true);
      const at = (bone: "leftHand" | "leftShoulder" | "leftLowerArm" | "rightHand" | "rightShoulder" | "hips") =>
        vrm.humanoid.getRawBoneNode(bone)!.getWorldPosition(new Vector3());
      for (const side of ["left", "right"] as const) {
        const hand = at(`${side}Hand`);
        // The arms of 0.47 m hang almost vertically, and the elbows bend a little towards the face (kBelowHorizontalRad
        // and kElbowRad of lowerArms.ts).
        expect(hand.y).toBeLessThan(at(`${side}Shoulder`).y - 0.35);
        expect(Math.abs(hand.x)).toBeGreaterThan(0.15);
        expect(Math.sign(hand.x)).toBe(side === "left" ? 1 : -1);
        expect(hand.z).toBeGreaterThan(0.02);
      }
    });

    test("lowers arms that hang at rest already to the same place", () => {
      const before = handHeight();
      for (const side of ["left", "right"] as const) {
        const arm = vrm.humanoid.getNormalizedBoneNode(`${side}LowerArm`)!;
        // The rest pose now has arms that hang 0.6 rad lower, as some exporters write them.
        arm.position.applyAxisAngle(new Vector3(0, 0, 1), -0.6 * Math.sign(arm.position.x));
      }
      expect(handHeight()).toBeCloseTo(before, 5);
    });

    function handHeight(): number {
      lowerArms(vrm);
      const arm = vrm.humanoid.getNormalizedBoneNode("leftUpperArm")!;
      return vrm.humanoid.getNormalizedBoneNode("leftLowerArm")!.position.clone().applyQuaternion(arm.quaternion).y;
    }
  });

describe("a model's skeleton as a pose", () => {
  test("at rest has all bones equal: head space at the head joint, facing where the model does", () => {
    const pose = new VrmSkeleton(vrm).pose();
    expect(poseError(pose)).toBeNull();
    // Each rotation is the identity, and each transform moves head space to the head joint.
    for (let bone = 0; bone < 5; ++bone) {
      const at = bone * kNumbersPerBone;
      expect([...pose.subarray(at, at + 3)].every((x) => Math.abs(x) < 1e-6)).toBe(true);
      expect([...pose.subarray(at + 4, at + 7)]).toEqual(headJoint.toArray().map((x) => expect.closeTo(x, 5)));
    }
  });

  // A page may put the hair on a model that is in the middle of an animation.
  test("is the same whatever the model did before", () => {
    vrm.humanoid.getRawBoneNode("neck")!.rotation.set(0.4, 0.6, 0.1);
    vrm.humanoid.getRawBoneNode("head")!.rotation.set(-0.3, 0.2, 0.5);
    const skeleton = new VrmSkeleton(vrm);
    const turned = skeleton.pose();
    // The skeleton is made while head and neck are turned. Without a reset to rest it would take that for the rest
    // pose.
    expect(Math.abs(turned[1])).toBeGreaterThan(0.1);
    vrm.humanoid.resetRawPose();
    const pose = skeleton.pose();
    for (let bone = 0; bone < 5; ++bone) expect(pose[bone * kNumbersPerBone + 3]).toBeCloseTo(1, 6);
  });

  test("turns the neck about the neck's joint and leaves the trunk", () => {
    const skeleton = new VrmSkeleton(vrm);
    const neckJoint = skeleton.joint(Bone.neck);
    // The neck joint of the made model is 9 cm below its head joint (skeleton.ts).
    expect(neckJoint.y).toBeCloseTo(-0.09, 5);
    vrm.humanoid.getRawBoneNode("neck")!.rotation.y = 0.5;
    const pose = skeleton.pose();
    expect(moved(pose, Bone.neck, neckJoint).distanceTo(neckJoint.clone().add(headJoint))).toBeLessThan(1e-5);
    expect(pose[Bone.upperTrunk * kNumbersPerBone + 1]).toBeCloseTo(0, 6);
    // The quaternion of a turn by 0.5 rad about +Y has sin(0.25) as its second number. The head turns with the neck.
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

  test("of a VRM 0 model looks the other way until the model is turned", async () => {
    vrm = await load({ version: 0 });
    vrm.scene.rotation.y = 0;
    const pose = new VrmSkeleton(vrm).pose();
    // A model of VRM 0 looks along -Z: half a turn about +Y away from head space.
    expect(Math.abs(pose[1])).toBeCloseTo(1, 5);
  });

  test("bones that a model lacks are stood in for by those it has", () => {
    for (const bone of ["neck", "leftShoulder", "rightShoulder", "upperChest"] as const)
      delete vrm.humanoid.humanBones[bone];
    expect(vrm.humanoid.getRawBoneNode("neck")).toBeNull();
    const skeleton = new VrmSkeleton(vrm);
    vrm.humanoid.getRawBoneNode("chest")!.rotation.y = 0.3;
    vrm.humanoid.getRawBoneNode("head")!.rotation.x = 0.4;
    const pose = skeleton.pose();
    expect(poseError(pose)).toBeNull();
    const of = (bone: Bone) => [...pose.subarray(bone * kNumbersPerBone, (bone + 1) * kNumbersPerBone)];
    expect(of(Bone.neck)).toEqual(of(Bone.head));
    expect(of(Bone.leftShoulder)).toEqual(of(Bone.upperTrunk));
    expect(of(Bone.rightShoulder)).toEqual(of(Bone.upperTrunk));
    // The quaternion is that of a rotation by 0.3 rad about +Y.
    const chest = [0, Math.sin(0.15), 0, Math.cos(0.15)];
    expect(of(Bone.upperTrunk).slice(0, 4)).toEqual(chest.map((x) => expect.closeTo(x, 5)));
    expect(of(Bone.head)[0]).toBeCloseTo(Math.sin(0.2) * Math.cos(0.15), 5);
  });
});

// The four scales are a larger model, two that are mirrored in one axis, and one that is mirrored in all three.
// `attach` draws the hair at the head bone, while the pose for the server has no scale.
describe("hair on a model", () => {
  for (const scale of [
    [2, 2, 2],
    [-1, 1, 1],
    [1.5, 1.5, -1.5],
    [-1, -1, -1],
  ] as const)
    for (const when of ["before", "after"])
      test(`is where its bones are, also scaled by ${scale.join(" ")} ${when} it gets the hair`, () => {
        vrm.scene.position.set(3, 0, -1);
        vrm.scene.rotation.y = 1;
        if (when === "before") vrm.scene.scale.fromArray(scale);
        const vrmHair = new VrmHair(vrm);
        if (when === "before") vrmHair.fit(madeGroom());
        vrm.scene.scale.fromArray(scale);
        vrm.humanoid.getRawBoneNode("neck")!.rotation.set(0.2, 0.5, -0.1);
        vrm.humanoid.getRawBoneNode("head")!.rotation.set(-0.1, 0.3, 0.2);
        const pose = vrmHair.pose();
        expect(poseError(pose)).toBeNull();
        const character = new HairCharacter(1, true, "");
        vrmHair.attach(character);
        const placed = place(character, pose, new Matrix4()) as Placed;
        // A scale that mirrors has a negative determinant, and a mirrored character has a negative size.
        expect(Math.sign(placed.size)).toBe(Math.sign(vrm.scene.matrixWorld.determinant()));
        const drawn = (bone: Bone, ofGroom: Vector3) =>
          moved(placed.pose, bone, ofGroom.clone().multiplyScalar(placed.size));
        const point = new Vector3(0.05, 0.1, 0.03);
        const wanted = point.clone().applyMatrix4(vrmHair.skeleton.anchor.matrixWorld);
        expect(drawn(Bone.head, point).distanceTo(wanted)).toBeLessThan(1e-5);
        // The other bones keep their places, too. The skin of the shoulders moves with them, and hair must stay out of
        // it.
        const { size, offset } = vrmHair.headFit;
        for (const [bone, name] of [
          [Bone.leftShoulder, "leftShoulder"],
          [Bone.upperTrunk, "upperChest"],
        ] as const) {
          const rest = vrmHair.skeleton
            .joint(bone)
            .sub(new Vector3(...offset))
            .divideScalar(size);
          const joint = vrm.humanoid.getRawBoneNode(name)!.getWorldPosition(new Vector3());
          expect(drawn(bone, rest).distanceTo(joint)).toBeLessThan(0.02);
        }
        vrmHair.dispose();
      });

  for (const version of [0, 1] as const)
    for (const headSize of [0.5, 1, 2, 3])
      test(`fits heads of size ${headSize} in VRM ${version} within millimetres`, async () => {
        vrm = await load({ version, headSize });
        // The groom's head is this model's at size 1, moved: the fit is known.
        const one = new VrmHair(await load());
        const { vertices, triangles } = skullOf(one);
        // The groom was made on the same skull, 4 cm lower. So the right fit maps each of its points to headSize times
        // the point of this model.
        const up = 0.04;
        const count = vertices.length / 3;
        const body = {
          vertices: vertices.map((x, n) => (n % 3 === 1 ? x - up : x)),
          triangles,
          boneWeights: Float32Array.from({ length: 5 * count }, (_, n) => (n % 5 === 0 ? 1 : 0)),
        };
        const vrmHair = new VrmHair(vrm);
        vrmHair.fit({ body });
        const { size, offset } = vrmHair.headFit;
        // The points of the scalp (head space of the model, m) are the top, the back, the left and the forehead.
        for (const crown of [
          [0, 0.19, 0],
          [0, 0.08, -0.1],
          [0.08, 0.08, 0],
          [0, 0.15, 0.08],
        ])
          for (let axis = 0; axis < 3; ++axis) {
            const inGroom = crown[axis] - (axis === 1 ? up : 0);
            expect(Math.abs(size * inGroom + offset[axis] - headSize * crown[axis])).toBeLessThan(0.002 * headSize);
          }
      });

  test("does not sink into a head of another shape, nor float above it", () => {
    const vrmHair = new VrmHair(vrm);
    // The skull of madeGroom is an egg with half axes of 0.08, 0.12 and 0.1 m about (0, 0.08, 0.02).
    vrmHair.fit(madeGroom());
    const { size, offset } = vrmHair.headFit;
    // The anchor is at the hair's place now, so these are the groom's coordinates.
    const head = modelHeadTriangles(vrm, vrmHair.skeleton.anchor, vrmHair.hiddenMeshes, new Set());
    const surface = new HeadSurface(head, new Vector3(0, 0.08, 0.01));
    for (const direction of kScalp) {
      const onEgg = direction
        .clone()
        .multiply(new Vector3(0.08, 0.12, 0.1))
        .add(new Vector3(0, 0.08, 0.02));
      const at = onEgg.sub(surface.middle);
      const above = size * (at.length() - surface.radius(at));
      // The bounds are in m: hair is at most 12 mm inside the head, and 25 mm above it. The fit weighs hair inside the
      // head six times as much as hair above it (kBuriedWeight of headFit.ts), so the bound inside is the narrower one.
      expect(above).toBeGreaterThan(-0.012);
      expect(above).toBeLessThan(0.025);
    }
    expect(offset[0]).toBe(0);
  });

  test("can be made larger and moved by hand: the middle of the skull stays", () => {
    const vrmHair = new VrmHair(vrm);
    vrmHair.fit(madeGroom());
    const { size, offset } = vrmHair.headFit;
    // The middle of a groom's skull is 0.06 m above the head joint (kSkullMiddle of headFit.ts).
    const middle = size * 0.06 + offset[1];
    vrmHair.change({ size: 1.1, height: 0.02, depth: -0.01 });
    const changed = vrmHair.headFit;
    expect(changed.size).toBeCloseTo(1.1 * size, 6);
    expect(changed.size * 0.06 + changed.offset[1]).toBeCloseTo(middle + 0.02, 6);
    expect(changed.offset[2]).toBeCloseTo(offset[2] - 0.01, 6);
    vrmHair.fit(madeGroom());
    expect(vrmHair.headFit).toEqual(changed);
    vrmHair.change({});
    expect(vrmHair.headFit).toEqual({ size, offset });
  });

  test("hides other meshes than before, and shows those again", () => {
    const vrmHair = new VrmHair(vrm);
    const [hair] = vrmHair.hiddenMeshes;
    const eyes = vrm.scene.getObjectByName("Eyes") as SkinnedMesh;
    vrmHair.hide([eyes]);
    expect([hair.visible, eyes.visible]).toEqual([true, false]);
    vrmHair.dispose();
    expect([hair.visible, eyes.visible]).toEqual([true, true]);
  });

  test("sends poses whose other bones lie as the groom's own, and draws them as large as the model", () => {
    const vrmHair = new VrmHair(vrm, { headFit: { size: 1.25, offset: [0, 0.01, 0] } });
    vrm.humanoid.getRawBoneNode("head")!.rotation.x = 0.4;
    const pose = vrmHair.pose();
    expect(poseError(pose)).toBeNull();
    vrmHair.skeleton.anchor.updateWorldMatrix(true, false);
    const origin = new Vector3().setFromMatrixPosition(vrmHair.skeleton.anchor.matrixWorld);
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
    const vrmHair = new VrmHair(vrm);
    vrmHair.attach(character);
    expect(hair.visible).toBe(false);
    expect(character.bodyVisible).toBe(false);
    expect(character.anchor).toBe(vrmHair.skeleton.anchor);
    const head = vrm.humanoid.getRawBoneNode("head")!;
    expect(vrmHair.skeleton.anchor.parent).toBe(head);
    vrmHair.dispose();
    expect(hair.visible).toBe(true);
    expect(character.bodyVisible).toBe(true);
    expect(character.anchor).toBeNull();
    expect(vrmHair.skeleton.anchor.parent).toBeNull();
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

/** The head of a model as a mesh, head space, m. */
function skullOf(vrmHair: VrmHair): { vertices: Float32Array; triangles: Uint32Array } {
  const { skeleton, hiddenMeshes } = vrmHair;
  skeleton.setAnchor([0, 0, 0], 1);
  const vertices = Float32Array.from(modelHeadTriangles(skeleton.vrm, skeleton.anchor, hiddenMeshes, new Set()));
  return { vertices, triangles: Uint32Array.from({ length: vertices.length / 3 }, (_, n) => n) };
}
