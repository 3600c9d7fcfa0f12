import type { VRM } from "@pixiv/three-vrm";
import type { Mesh } from "three";
import type { Groom } from "../hair/groom";
import type { Pose } from "../hair/pose";
import type { HairCharacter } from "../scene/hairCharacter";
import { fitHead, kNoFit, type HeadFit } from "./headFit";
import { findHairMeshes } from "./vrmHairMeshes";
import { VrmSkeleton } from "./vrmSkeleton";

export interface VrmHairOptions {
  /** Meshes of the model's own hair; by default `findHairMeshes` finds them. None: `[]`. */
  hairMeshes?: readonly Mesh[];
  /** How the groom fits the model's head; by default `fitHead` measures both when `fit` gets the groom. */
  headFit?: HeadFit;
}

/**
 * Gives a VRM model a character's hair: hides the model's own hair, makes the character follow the head bone, and does
 * not draw the groom's own bust. `dispose` undoes all of it.
 */
export class VrmHair {
  readonly skeleton: VrmSkeleton;
  readonly hiddenMeshes: readonly Mesh[];
  #fit: HeadFit;
  readonly #fitIsGiven: boolean;
  #character: HairCharacter | null = null;
  #bodyWasVisible = true;
  readonly #meshWasVisible: boolean[];

  constructor(vrm: VRM, options: VrmHairOptions = {}) {
    this.skeleton = new VrmSkeleton(vrm);
    this.hiddenMeshes = options.hairMeshes ?? findHairMeshes(vrm);
    this.#meshWasVisible = this.hiddenMeshes.map((mesh) => mesh.visible);
    for (const mesh of this.hiddenMeshes) mesh.visible = false;
    this.#fitIsGiven = options.headFit !== undefined;
    this.#fit = options.headFit ?? kNoFit;
    this.#placeAnchor();
  }

  /** The size of the model's head relative to the groom's. */
  get size(): number {
    return this.#fit.size;
  }

  /** Measures this groom against the model's head, unless `headFit` was given. */
  fit(groom: Groom): void {
    if (this.#fitIsGiven) return;
    this.#fit = kNoFit;
    this.#placeAnchor();
    this.#fit = fitHead(groom, this.skeleton.vrm, this.skeleton.anchor, this.hiddenMeshes);
    this.#placeAnchor();
  }

  /** Gives the model this character's hair from now on, and releases the previous character. */
  wear(character: HairCharacter | null): void {
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
    this.wear(null);
    for (const [n, mesh] of this.hiddenMeshes.entries()) mesh.visible = this.#meshWasVisible[n];
    this.skeleton.dispose();
  }

  // Computes the place of the groom's head joint, and the scale.
  #placeAnchor(): void {
    this.skeleton.setAnchor(this.#fit.offset, this.#fit.size);
  }
}
