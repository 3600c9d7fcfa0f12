import type { Appearance } from "./appearance";
import type { Groom } from "./groom";
import type { MovedLattice } from "./movedLattice";
import type { Pose } from "./pose";
import type { Skin } from "./skin";

/** One character of a room at one moment. */
export interface ShownMember {
  /** its number in the room */
  readonly member: number;
  /** it belongs to this session */
  readonly own: boolean;
  /** identifies its groom: equal for all members with this groom */
  readonly groomKey: string;
  /** null: not received yet */
  readonly groom: Groom | null;
  /** world; null: not received yet */
  readonly pose: Pose | null;
  /** that its hair follows; null: its hair is at rest */
  readonly lattice: MovedLattice | null;
  /** the skin to keep its hair out of, the same object for all characters of a groom; absent or null: not known, or none */
  readonly skin?: Skin | null;
  /** how its owner wants it drawn; absent: the default of its number */
  readonly appearance?: Appearance;
}

/** The height of a member's drawn head over the screen's height, and whether any of it is visible. */
export interface MemberImportance {
  readonly member: number;
  readonly screenHeight: number;
  readonly inView: boolean;
}

/** The source of a `HairScene`'s characters: a `Room`, a `LocalRoom`, or another one. */
export interface HairSource {
  /**
   * Returns all members at this moment; `nowMs` is a time of `performance.now()`. The result is valid until the next
   * call.
   */
  sample(nowMs: number): readonly ShownMember[];
  /** Called a few times a second with the importance of members. */
  reportImportance?(members: readonly MemberImportance[]): void;
}
