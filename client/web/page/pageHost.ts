import type { OwnCharacter, Room } from "../src/index";
import type { HairScene } from "../src/scene/index";
import type { Focus } from "./focus";
import type { Hairstyle } from "./hairstyles";
import type { OwnHead } from "./ownHead";
import type { Sliders } from "./sliders";
import type { Stage } from "./stage";

/** What the page offers to the parts of its panel. Room and hair change when a connection ends. */
export interface PageHost {
  readonly stage: Stage;
  readonly focus: Focus;
  /** the user's own head, worn or not */
  readonly head: OwnHead;
  readonly sliders: Sliders;
  readonly room: Room | null;
  readonly hair: HairScene | null;
  /** null: the user only watches */
  readonly own: OwnCharacter | null;
  /** Wears the hairstyle in this room and in later ones; null: none. Reports its own faults. */
  wear(hairstyle: Hairstyle | null): Promise<void>;
  /** Shows one line of what went wrong and what helps. */
  fault(detail: string): void;
}
