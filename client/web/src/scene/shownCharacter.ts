import { Color } from "three";
import type { ShownMember } from "../hair/hairSource";
import { rigidPose, type Pose } from "../hair/pose";
import type { DrawDetail } from "./drawDetail";
import type { Drawn, GroomDrawing } from "./groomDrawing";
import type { HairCharacter } from "./hairCharacter";
import type { CharacterRecord } from "./records";

/** The id of the newest character; ids begin at 1, as 0 means none (`CharacterRecord.id`). */
let lastId = 0;

/**
 * A character in the pictures of a `HairScene`: one object from picture to picture, so that crowds leave no garbage.
 */
export class ShownCharacter implements Drawn, CharacterRecord {
  member!: ShownMember;
  /** The index of the character in this picture's `Records`. */
  number = 0;
  pose: Pose = rigidPose();
  size = 1;
  /** The height of the head over the height of the main view. */
  screenHeight = 0;
  inView = false;
  drawing: GroomDrawing | null = null;
  /** The character has a place in this picture: no scale hides it. */
  isShown = false;
  /** The hair is loaded, and a view sees it. */
  isDrawn = false;
  readonly detail: DrawDetail = { strandShare: 0, followHairCount: 0, toleranceM: 0, quadratic: 0 };
  list = 0;
  readonly hair = new Color();
  readonly hairTip = new Color();
  readonly skin = new Color();
  roughness = 0;
  firstRow = 0;
  rowCount = 0;
  hasLight = false;
  ballRadiusM = 0;
  readonly #id = ++lastId;

  constructor(readonly character: HairCharacter) {}

  /** The id by which the motion is followed, which counts in the main view alone; 0: outside of it. */
  get id(): number {
    return this.inView ? this.#id : 0;
  }

  get bodyVisible(): boolean {
    return this.character.bodyVisible;
  }

  get strands(): GroomDrawing {
    return this.drawing!;
  }
}
