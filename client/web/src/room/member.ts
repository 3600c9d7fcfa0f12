import type { Appearance } from "../hair/appearance";
import type { Groom } from "../hair/groom";
import { LevelIndex } from "../hair/level";
import type { MovedLattice } from "../hair/movedLattice";
import { kPoseNumbers, type Pose } from "../hair/pose";
import type { Skin } from "../hair/skin";
import { tagText } from "../hair/tag";
import { ModuleLattice, type Scene, type Shown } from "./shown";

/** One character of a room, as it was at the last `sample`. */
export class Member {
  /** The member's number in the room. */
  readonly member: number;
  /** For an own character, this client's number of it (`OwnCharacter.character`); 0: another client's character. */
  readonly character: number;
  /** Identifies the groom: equal for all members with this groom. */
  readonly groomKey: string;
  /** The owner's number of the character. With `session` it means the same character to all clients. */
  readonly ownerCharacter: number;
  /** The hairstyle; null: it has not arrived yet. */
  groom: Groom | null = null;
  /** The skin that hair is kept out of; null: it has not arrived yet. */
  skin: Skin | null = null;
  /** Why the groom cannot be shown, in one line; empty: it can be shown, or has not arrived yet. */
  error = "";
  /** The bones in the world; null: no pose is known. The array is reused by the next `sample`. */
  pose: Pose | null = null;
  /** What moves the hair; null: the hair is at rest. */
  lattice: MovedLattice | null = null;
  /** The level at which the hair is simulated. */
  level = LevelIndex.rigid;
  /** The time from the sampling of the poses at the owner to their showing here, s; 0 without a frame. */
  delayS = 0;
  /** Any bytes, at most 256, that the owner's application gave it. */
  tag: Uint8Array = new Uint8Array();
  /** As the owner wants it drawn; the default of its number if the owner does not say. */
  appearance: Appearance;
  /** What the module shows; this member is its character of the number `#index`. */
  readonly #scene: Scene;
  #sessionLow = 0;
  #sessionHigh = 0;
  #lattice: ModuleLattice | null = null;
  #index = 0;

  /** @internal */
  constructor(scene: Scene, shown: Shown) {
    this.#scene = scene;
    this.member = shown.member;
    this.character = shown.own;
    this.ownerCharacter = shown.ownerCharacter;
    this.groomKey = shown.groomKey;
    this.appearance = shown.appearance;
    this.describe(shown);
  }

  /** The owner's session; another after this client's has ended and a new one begun. */
  get session(): bigint {
    return (BigInt(this.#sessionHigh) << 32n) | BigInt(this.#sessionLow);
  }

  get own(): boolean {
    return this.character !== 0;
  }

  /** The tag as text, such as a person's name; "" if it is no UTF-8 or has control characters. */
  get tagText(): string {
    return tagText(this.tag);
  }

  /**
   * The points of the hair now, in world space: 3 numbers for each point of the groom. `out`: an array of that length
   * to write to. Returns null while the groom or the pose is missing.
   */
  points(out?: Float32Array): Float32Array | null {
    if (!this.groom || !this.pose) return null;
    const points = out ?? new Float32Array(3 * this.groom.pointCount);
    this.#scene.pointsOf(this.#index, points);
    return points;
  }

  /** @internal Takes tag and appearance. */
  describe(shown: Shown): void {
    this.tag = shown.tag;
    this.appearance = shown.appearance;
  }

  /** @internal Takes what changes with time. `index`: of the character in the scene. */
  show(shown: Shown, index: number): void {
    this.#index = index;
    this.#sessionLow = shown.sessionLow;
    this.#sessionHigh = shown.sessionHigh;
    this.level = shown.level;
    this.delayS = shown.delayS;
    if (!this.groom) this.error = shown.error;
    if (shown.hasPose) {
      this.pose ??= new Float64Array(kPoseNumbers);
      shown.readPose(this.pose);
    } else this.pose = null;
    if (!shown.moves) {
      this.lattice = null;
      return;
    }
    if (!this.#lattice?.fits(shown)) this.#lattice = new ModuleLattice(this.#scene, shown, shown.basis);
    this.#lattice.show(index);
    this.lattice = this.#lattice;
  }
}
