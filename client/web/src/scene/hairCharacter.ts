import { Color, Object3D } from "three";
import { defaultAppearance, type Appearance } from "../hair/appearance";
import type { DrawDetail } from "./drawDetail";

/**
 * One character of a `HairScene`, placed at its head: +Y up, +Z out of the face, the origin at the head joint. Objects
 * added to it (a hat, a name) follow the head. Its hair is drawn together with that of other characters, not by this
 * object; `visible` shows or hides it nevertheless.
 */
export class HairCharacter extends Object3D {
  /**
   * The colour of the hair at its root. This and the next three are the member's appearance, and are set again when the
   * owner changes it.
   */
  readonly hairColour = new Color();
  /** The colour of the hair at its tip; null: as at the root. */
  hairTipColour: Color | null = null;
  readonly skinColour = new Color();
  /** The roughness of the hair, 0 (sharp highlights) to 1. */
  roughness = 0;
  /** False: its colours and roughness are the program's own, and the owner's changes are not shown. */
  followsMember = true;
  /** Whether the groom's own bust is drawn. */
  bodyVisible = true;
  /** The detail of the hair; null: chosen by the head's size on the screen. */
  detail: DrawDetail | null = null;
  /**
   * Another object that defines the head's place, aligned to head space at rest (a VRM's head, see
   * `hairnet-client/vrm`): hair is drawn there, with its world scale, and the pose from the network is not used.
   */
  anchor: Object3D | null = null;
  /** Poses have arrived and its groom is ready: it can be drawn. */
  isReady = false;
  /** The last appearance of the member that was taken over, compared as an object. */
  #followed: Appearance | null = null;

  constructor(
    readonly member: number,
    readonly own: boolean,
    /** Identifies the groom: equal for all members with this groom. */
    public groomKey: string,
  ) {
    super();
    this.name = `hairnet character ${member}`;
    this.setAppearance(defaultAppearance(member));
  }

  /** @internal Takes over what is new in the appearance of its member. */
  follow(appearance: Appearance | undefined): void {
    if (appearance === undefined || appearance === this.#followed) return;
    this.#followed = appearance;
    if (this.followsMember) this.setAppearance(appearance);
  }

  setAppearance({ hairRoot, hairTip, skin, roughness }: Appearance): void {
    this.hairColour.setHex(hairRoot);
    this.hairTipColour = hairTip === hairRoot ? null : new Color().setHex(hairTip);
    this.skinColour.setHex(skin);
    this.roughness = roughness;
  }
}
