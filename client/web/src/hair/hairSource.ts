import type { Appearance } from "./appearance";
import type { Groom } from "./groom";
import type { MovedLattice } from "./movedLattice";
import type { Pose } from "./pose";
import type { Skin } from "./skin";

/** One character of a room at one moment. */
export interface ShownMember {
  /** The member's number in the room. */
  readonly member: number;
  /** The character belongs to this client. */
  readonly own: boolean;
  /** Identifies the groom: equal for all members with this groom. */
  readonly groomKey: string;
  /** The hairstyle; null: it has not arrived yet. */
  readonly groom: Groom | null;
  /** The bones, world; null: no pose has arrived yet. */
  readonly pose: Pose | null;
  /** The lattice that the hair follows; null: the hair is at rest. */
  readonly lattice: MovedLattice | null;
  /**
   * The skin that hair is kept out of, the same object for all characters of a groom. Absent or null: there is none, or
   * it is not known yet.
   */
  readonly skin?: Skin | null;
  /** How the owner wants the character drawn; absent: the default of the member's number. */
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
  /** Gets the importance of members a few times a second. Absent: nobody wants it. */
  reportImportance?(members: readonly MemberImportance[]): void;
}
