import type { HeadAngles } from "./headPose";

/** Something beside mouse and keys that turns the own head. */
export interface HeadSource {
  /** relative to looking ahead; null: unknown at this moment */
  readonly angles: HeadAngles | null;
  /** Frees sensors and cameras. */
  stop(): void;
}
