import { Color, Object3D } from "three";
import type { DrawDetail } from "./drawDetail";

/** In the order in which characters get them: neighbours have different colours. Linear RGB albedo. */
const kHairColours: readonly (readonly [number, number, number])[] = [
  [0.14, 0.065, 0.03], // brown
  [0.52, 0.36, 0.17], // blonde
  [0.022, 0.017, 0.014], // black
  [0.34, 0.1, 0.03], // red
  [0.3, 0.19, 0.09], // dark blonde
  [0.06, 0.03, 0.016], // dark brown
  [0.2, 0.055, 0.025], // auburn
  [0.42, 0.42, 0.43], // grey
];

/**
 * One character of a `HairScene`, placed at its head: +Y up, +Z out of the face, the origin at the head joint. Objects
 * added to it (a hat, a name) follow the head. Its hair is drawn together with that of other characters, not by this
 * object; `visible` shows or hides it nevertheless.
 */
export class HairCharacter extends Object3D {
  /** linear RGB albedo */
  readonly hairColour: Color;
  readonly skinColour = new Color().setRGB(0.75, 0.52, 0.42);
  /** Whether the groom's own bust is drawn. */
  bodyVisible = true;
  /** null: chosen by its size on the screen */
  detail: DrawDetail | null = null;
  /**
   * Another object that defines the head's place, aligned to head space at rest (a VRM's head, see
   * `hairnet-client/vrm`): hair is drawn there, with its world scale, and the pose from the network is not used.
   */
  anchor: Object3D | null = null;
  /** Poses have arrived and its groom is ready: it can be drawn. */
  isReady = false;

  constructor(
    readonly member: number,
    readonly own: boolean,
    /** identifies its groom: equal for all members with this groom */
    public groomKey: string,
  ) {
    super();
    this.name = `hairnet character ${member}`;
    const colour = kHairColours[(member + kHairColours.length - 1) % kHairColours.length];
    this.hairColour = new Color().setRGB(...colour);
  }
}
