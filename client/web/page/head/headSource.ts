import type { HeadAngles } from "./headPose";

/** Something beside mouse and keys that turns the own head. */
export interface HeadSource {
  /** The angles of the head, relative to looking ahead; null: not known now. */
  readonly angles: HeadAngles | null;
  /** Frees sensors and cameras. */
  stop(): void;
}
