import type { VRM } from "@pixiv/three-vrm";
import type { Mesh, Object3D } from "three";
import type { Groom } from "../hair/groom";
import type { Pose } from "../hair/pose";
import type { HairCharacter } from "../scene/hairCharacter";
import { changedFit, fitHead, kNoFit, type HeadFit, type HeadFitChange } from "./headFit";
import { findHairBones, findHairMeshes, hideTriangles } from "./vrmHairMeshes";
import { meshesOf } from "./vrmMeshes";
import { VrmSkeleton } from "./vrmSkeleton";

export interface VrmHairOptions {
  /** Meshes of the model's own hair; by default `findHairMeshes` finds them. None: `[]`. */
  hairMeshes?: readonly Mesh[];
  /**
   * Bones of the model's own hair: their triangles are hidden in all meshes; by default `findHairBones` finds them.
   * None: an empty set.
   */
  hairBones?: ReadonlySet<Object3D>;
  /** How the groom fits the model's head; by default `fitHead` measures both when `fit` gets the groom. */
  headFit?: HeadFit;
  /** A change of the fit by hand. */
  change?: HeadFitChange;
}

/**
 * Gives a VRM model a character's hair: hides the model's own hair, makes the character follow the head bone, and does
 * not draw the groom's own bust. `dispose` undoes all of it.
 */
export class VrmHair {
  readonly skeleton: VrmSkeleton;
  /** The meshes that are not drawn. */
  #hidden: readonly Mesh[] = [];
  /** The bones of the model's own hair. */
  readonly #bones: ReadonlySet<Object3D>;
  /** These functions draw the hidden triangles again. */
  readonly #showTriangles: readonly (() => void)[];
  /** The fit that was measured or given, without the change by hand. */
  #fit: HeadFit;
  #change: HeadFitChange;
  /** The program gave the fit, so `fit` measures nothing. */
  readonly #fitIsGiven: boolean;
  #character: HairCharacter | null = null;
  /** What `attach` and `hide` have changed, to undo it. */
  #bodyWasVisible = true;
  readonly #wasVisible = new Map<Mesh, boolean>();

  constructor(vrm: VRM, options: VrmHairOptions = {}) {
    this.skeleton = new VrmSkeleton(vrm);
    this.hide(options.hairMeshes ?? findHairMeshes(vrm));
    this.#bones = options.hairBones ?? findHairBones(vrm);
    this.#showTriangles = meshesOf(vrm).flatMap((mesh) => hideTriangles(mesh, this.#bones) ?? []);
    this.#fitIsGiven = options.headFit !== undefined;
    this.#fit = options.headFit ?? kNoFit;
    this.#change = options.change ?? {};
    this.#placeAnchor();
  }

  /** The meshes of the model that are not drawn. */
  get hiddenMeshes(): readonly Mesh[] {
    return this.#hidden;
  }

  /** The size of the model's head relative to the groom's. */
  get size(): number {
    return this.headFit.size;
  }

  /** The current fit, with the change by hand. */
  get headFit(): HeadFit {
    return changedFit(this.#fit, this.#change);
  }

  /** Hides these meshes of the model, and shows those that were hidden before. The next `fit` does not measure them. */
  hide(meshes: readonly Mesh[]): void {
    for (const [mesh, visible] of this.#wasVisible) mesh.visible = visible;
    this.#wasVisible.clear();
    for (const mesh of meshes) {
      this.#wasVisible.set(mesh, mesh.visible);
      mesh.visible = false;
    }
    this.#hidden = [...meshes];
  }

  /** Measures the body of this groom against the model's head, unless `headFit` was given. */
  fit(groom: Pick<Groom, "body">): void {
    if (this.#fitIsGiven) return;
    this.skeleton.setAnchor(kNoFit.offset, kNoFit.size);
    this.#fit = fitHead(groom, this.skeleton.vrm, this.skeleton.anchor, this.#hidden, this.#bones);
    this.#placeAnchor();
  }

  /** Changes the fit by hand, relative to the measured or given one. */
  change(change: HeadFitChange): void {
    this.#change = change;
    this.#placeAnchor();
  }

  /** Gives the model this character's hair from now on, and releases the previous character. */
  attach(character: HairCharacter | null): void {
    if (this.#character) {
      this.#character.anchor = null;
      this.#character.bodyVisible = this.#bodyWasVisible;
    }
    this.#character = character;
    if (!character) return;
    this.#bodyWasVisible = character.bodyVisible;
    character.bodyVisible = false;
    character.anchor = this.skeleton.anchor;
  }

  /** The current bones of the model, for the pose of an own character. World. */
  pose(out?: Pose): Pose {
    return this.skeleton.pose(out);
  }

  dispose(): void {
    this.attach(null);
    this.hide([]);
    for (const show of this.#showTriangles) show();
    this.skeleton.dispose();
  }

  // Computes the place of the groom's head joint, and the scale.
  #placeAnchor(): void {
    const { offset, size } = this.headFit;
    this.skeleton.setAnchor(offset, size);
  }
}
