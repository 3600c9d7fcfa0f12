import type { MaterialScale, OwnCharacter, People, WindOptions } from "../src/index";
import type { HairScene } from "../src/scene/index";
import type { Focus } from "./focus";
import type { OwnHead } from "./head/ownHead";
import type { Query } from "./query";
import type { Stage } from "./stage";

/**
 * What the page offers to the parts of its panel. Room and hair change when a connection ends. A part that moves the
 * camera itself sets `stage.orbit.enabled` to false meanwhile.
 */
export interface PageHost {
  readonly stage: Stage;
  readonly focus: Focus;
  /** The user's own head, also while the user has no character. */
  readonly head: OwnHead;
  readonly query: Query;
  readonly room: People | null;
  readonly hair: HairScene | null;
  /** The user's own character; null: the user only watches. */
  readonly own: OwnCharacter | null;
  /** Sets the material of the own hair, also of the hairstyles that the user chooses later. */
  setMaterial(scale: MaterialScale): void;
  /** Sets the wind of the room, for everyone. */
  setWind(wind: WindOptions): void;
  /** Shows one line of what went wrong and what helps. */
  showError(detail: string): void;
}
