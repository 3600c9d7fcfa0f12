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
  /** the user's own head, worn or not */
  readonly head: OwnHead;
  readonly query: Query;
  readonly room: People | null;
  readonly hair: HairScene | null;
  /** null: the user only watches */
  readonly own: OwnCharacter | null;
  /** Of the own hair, now and later. */
  setMaterial(scale: MaterialScale): void;
  /** Of the room, for everyone. */
  setWind(wind: WindOptions): void;
  /** Shows one line of what went wrong and what helps. */
  showError(detail: string): void;
}
