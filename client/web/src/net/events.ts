import type { Frame } from "../hair/frame";
import type { GroomHash } from "./groomHash";
import type {
  CharacterAdded,
  CharacterRemoved,
  ErrorMessage,
  GoodbyeReason,
  GroomStatus,
  MemberChanged,
  MemberJoined,
  MemberLeft,
  RoomWind,
  Welcome,
} from "./messages";

// The events of a client, in order.

export interface Connected {
  readonly type: "connected";
  readonly welcome: Welcome;
  /** after Reconnecting; `welcome.resumed` says whether the server still had the session */
  readonly again: boolean;
}
/** The connection is lost and the link is reconnecting; Connected or Disconnected follows. */
export interface Reconnecting {
  readonly type: "reconnecting";
  /** the server's; none when the connection broke */
  readonly reason: GoodbyeReason;
  readonly detail: string;
  /** before the next attempt */
  readonly waitS: number;
}
/** The last event. */
export interface Disconnected {
  readonly type: "disconnected";
  /** the server's, or clientLeaves after leaving, or none when the connection broke */
  readonly reason: GoodbyeReason;
  /** one line of what happened */
  readonly detail: string;
}
/** A groom that was requested: its file's bytes, as `decodeGroom` takes them; or null, and why in one line. */
export interface GroomFetched {
  readonly type: "groomFetched";
  readonly hash: GroomHash;
  readonly bytes: Uint8Array | null;
  readonly fault: string;
}
/** Frames of one tick, decoded. */
export interface FrameBatch {
  readonly type: "frameBatch";
  readonly tick: number;
  /** server's clock: when the poses were sampled */
  readonly sampleTimeNs: number;
  readonly frames: readonly Frame[];
}

export type LinkEvent =
  | Connected
  | Reconnecting
  | Disconnected
  | GroomStatus
  | CharacterAdded
  | CharacterRemoved
  | MemberJoined
  | MemberChanged
  | MemberLeft
  | RoomWind
  | FrameBatch
  | GroomFetched
  | ErrorMessage;

/** Takes frames in place of events. `sampleTimeNs` is on the server's clock. Not to call back into the link. */
export type FrameSink = (frame: Frame, sampleTimeNs: number, tick: number) => void;
