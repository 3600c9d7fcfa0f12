import type { LevelGeometry } from "./lattice";
import type { ErrorClass, LevelIndex } from "./level";
import type { Pose } from "./pose";

/** One character at one moment, decoded. */
export interface Frame {
  /** its number in the room */
  readonly member: number;
  /** this client's own number for it; 0: another client's character */
  readonly character: number;
  readonly level: LevelIndex;
  readonly errorClass: ErrorClass;
  /** teleport, reset or level switch: do not interpolate from the last frame */
  readonly discontinuous: boolean;
  /** the lattice is at rest: the server sends no further frame until the character wakes */
  readonly asleep: boolean;
  /** the last known hair from before a reconnect: the new server has no lattice yet */
  readonly lastKnown: boolean;
  /** ticks from one step of the character to the next */
  readonly stepStride: number;
  /** the same in seconds; 0: not known */
  readonly stepS: number;
  /** the pose of the step */
  readonly pose: Pose;
  /** 3 an active node, head space, in steps of the error class; empty: rigid */
  readonly displacements: Int16Array;
  /** in units of 32 steps a second, of the node in the world, in head axes; empty: not sent */
  readonly velocities: Int16Array;
  /** of the level; null: rigid */
  readonly geometry: LevelGeometry | null;
}
