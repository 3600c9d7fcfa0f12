import type { Groom } from "./groom";
import type { LatticeLayer } from "./latticeBlend";
import type { Pose } from "./pose";

/** One character of a room at one moment. */
export interface ShownMember {
  /** its number in the room */
  readonly member: number;
  /** it belongs to this session */
  readonly own: boolean;
  /** names its groom: the same for all that have it */
  readonly groomKey: string;
  /** null: not here yet */
  readonly groom: Groom | null;
  /** world; null: nothing is known of it yet */
  readonly pose: Pose | null;
  /** at most five; none: its hair is rigid */
  readonly layers: readonly LatticeLayer[];
}

/** How large a member's head is drawn, over the screen's height, and whether any of it is. */
export interface MemberImportance {
  readonly member: number;
  readonly screenHeight: number;
  readonly inView: boolean;
}

/** Where a `HairScene` has its characters from: a `Room`, or anything that has hair. */
export interface HairSource {
  /** Everybody at this moment; `nowMs` as of `performance.now()`. What it returns is read before the next call. */
  sample(nowMs: number): readonly ShownMember[];
  /** Told a few times a second how members are seen. */
  reportImportance?(members: readonly MemberImportance[]): void;
}
