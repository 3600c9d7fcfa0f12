import type { VRM } from "@pixiv/three-vrm";
import type { Mesh } from "three";
import type { Groom } from "../hair/groom";
import type { Pose } from "../hair/pose";
import type { HairCharacter } from "../scene/hairCharacter";
import { fitHead, kNoFit, type HeadFit } from "./headFit";
import { findHairMeshes } from "./vrmHairMeshes";
import { VrmSkeleton } from "./vrmSkeleton";

export interface VrmHairOptions {
  /** Meshes of the model's own hair; by default `findHairMeshes` looks for them. None: `[]`. */
  hairMeshes?: readonly Mesh[];
  /** How the groom sits on the model's head; by default `fitHead` measures both, once the groom is given to `fit`. */
  headFit?: HeadFit;
}

/**
 * A VRM model that wears a character's hair instead of its own: its own is hidden, the character follows its head bone,
 * and the groom's own bust is not drawn. `dispose` undoes all of it.
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

  /** How much larger the model's head is than the groom's. */
  get size(): number {
    return this.#fit.size;
  }

  /** Measures this groom against the model's head, unless how it sits was given. */
  fit(groom: Groom): void {
    if (this.#fitIsGiven) return;
    this.#fit = kNoFit;
    this.#placeAnchor();
    this.#fit = fitHead(groom, this.skeleton.vrm, this.skeleton.anchor, this.hiddenMeshes);
    this.#placeAnchor();
  }

  /** The model wears this character's hair from now on; what it wore before is let go. */
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

  /** Where the model's bones are now: what to send for a character of one's own. World. */
  pose(out?: Pose): Pose {
    return this.skeleton.pose(out);
  }

  dispose(): void {
    this.wear(null);
    this.hiddenMeshes.forEach((mesh, n) => (mesh.visible = this.#meshWasVisible[n]));
    this.skeleton.dispose();
  }

  // Where the groom's head joint comes to lie, and how large a metre of it is.
  #placeAnchor(): void {
    this.skeleton.setAnchor(this.#fit.offset, this.#fit.size);
  }
}
