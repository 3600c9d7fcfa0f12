import { VRMUtils, type VRM } from "@pixiv/three-vrm";
import type { Mesh, Object3D } from "three";
import type { Groom, Pose } from "../../src/index";
import type { HairCharacter } from "../../src/scene/index";
import { findHairMeshes, loadVrm, VrmHair } from "../../src/vrm/index";
import { AvatarMotion } from "./avatarMotion";
import type { RememberedFit } from "./rememberedFits";

/** A VRM model as the user's body: it moves with the user's head, and has the hair of the user's character. */
export class Avatar {
  readonly vrmHair: VrmHair;
  /** All meshes of the model: the indices of `RememberedFit.hidden` are those of this list. */
  readonly meshes: readonly Mesh[];
  /** The meshes that are taken for the model's own hair. */
  readonly #found: readonly Mesh[];
  readonly #motion: AvatarMotion;
  #groom: Groom | null = null;
  #character: HairCharacter | null = null;

  private constructor(
    readonly vrm: VRM,
    scene: Object3D,
  ) {
    const meshes: Mesh[] = [];
    vrm.scene.traverse((object) => {
      if ("isMesh" in object) meshes.push(object as Mesh);
    });
    // three.js knows the bounds of the rest pose only, and would leave out meshes that have moved into the view.
    for (const mesh of meshes) mesh.frustumCulled = false;
    this.meshes = meshes;
    this.#found = findHairMeshes(vrm);
    this.vrmHair = new VrmHair(vrm, { hairMeshes: this.#found });
    this.#motion = new AvatarMotion(vrm);
    this.#motion.root.visible = false;
    scene.add(this.#motion.root);
  }

  /** Throws `HairnetError` when the file is no VRM model. */
  static async load(file: Uint8Array, scene: Object3D): Promise<Avatar> {
    return new Avatar(await loadVrm(file), scene);
  }

  /** The name that the model's file gives it; empty if it gives none. */
  get name(): string {
    const { meta } = this.vrm;
    return (meta.metaVersion === "1" ? meta.name : meta.title) ?? "";
  }

  /** The height of the head joint above the feet, m. */
  get headHeight(): number {
    return this.#motion.headAtRest.y;
  }

  /** Applies what the user set. */
  set(fit: RememberedFit): void {
    const { hidden } = fit;
    const meshes = hidden ? this.meshes.filter((_, n) => hidden.includes(n)) : this.#found;
    this.vrmHair.change(fit);
    const before = this.vrmHair.hiddenMeshes;
    if (meshes.length === before.length && meshes.every((mesh) => before.includes(mesh))) return;
    this.vrmHair.hide(meshes);
    if (this.#groom) this.vrmHair.fit(this.#groom);
  }

  /** Each frame: follows the pose of the user's head, and returns the pose of the model. */
  update(character: HairCharacter | null, groom: Groom | null, pose: Pose, dtS: number): Pose {
    if (character !== this.#character) {
      this.vrmHair.attach(character);
      this.#character = character;
    }
    if (groom && groom !== this.#groom) {
      this.#groom = groom;
      this.vrmHair.fit(groom);
    }
    this.#motion.root.visible = character?.visible ?? false;
    this.#motion.update(pose, dtS);
    return this.vrmHair.pose();
  }

  dispose(): void {
    this.vrmHair.dispose();
    this.#motion.root.removeFromParent();
    VRMUtils.deepDispose(this.vrm.scene);
  }
}
