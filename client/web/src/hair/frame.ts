import type { HairBasis } from "./basis";
import type { LevelIndex } from "./level";
import type { Pose } from "./pose";

/** One character at one moment, decoded. Immutable. */
export interface Frame {
  /** its number in the room */
  readonly member: number;
  /** this client's own number for it; 0: another client's character */
  readonly character: number;
  /** that the server steps */
  readonly level: LevelIndex;
  /** teleport or reset: do not interpolate from the last frame */
  readonly discontinuous: boolean;
  /** the lattice is at rest: the server sends no further frame until the character wakes */
  readonly asleep: boolean;
  /** it came already, before its basis */
  readonly repeated: boolean;
  /** the last known hair from before a reconnect: the new server has no lattice yet */
  readonly lastKnown: boolean;
  /** ticks from one step of the character to the next */
  readonly stepStride: number;
  /** the same in seconds; 0: not known */
  readonly stepS: number;
  /** the pose of the step */
  readonly pose: Pose;
  /** m, of the basis; those that are missing at the end are 0 */
  readonly coefficients: Float32Array;
  /** null: the hair is at rest, or its basis has not arrived yet */
  readonly basis: HairBasis | null;
}
