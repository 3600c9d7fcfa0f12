import type { ErrorClass, LevelIndex } from "../hair/level";
import type { MemberImportance } from "../hair/hairSource";
import type { LevelGeometry } from "../hair/lattice";
import type { Pose } from "../hair/pose";
import type { ErrorReason, GoodbyeReason, GroomState, ObserveMode, Role } from "../generated/enums";
import { kRoomNameBytesMax, kRoomNameRule } from "../generated/limits";
import type { GroomHash } from "./groomHash";

export type { MemberImportance };

// What client and server say to each other; schema/PROTOCOL.md states bytes, states, limits and reasons.

export * from "../generated/limits";
export {
  ErrorReason,
  GoodbyeReason,
  GroomState,
  ObserveMode,
  Role,
  kErrorReasonLast,
  kGoodbyeReasonLast,
} from "../generated/enums";

// Times are nanoseconds as numbers: exact to 104 days, to 256 ns at 73 years. Ticks, offsets and sizes are exact to 2^53.

export interface Hello {
  readonly type: "hello";
  readonly protocolVersion: number;
  readonly clientName: string;
  /** empty: the lobby */
  readonly room: string;
  /** empty: none */
  readonly token: string;
  readonly role: Role;
  /** to be continued; 0: a new one */
  readonly session: bigint;
  /** 16 bytes, of that session */
  readonly secret: Uint8Array;
}
export interface GroomOffer {
  readonly type: "groomOffer";
  readonly hash: GroomHash;
  readonly byteCount: number;
}
export interface GroomChunk {
  readonly type: "groomChunk";
  readonly hash: GroomHash;
  readonly offset: number;
  readonly bytes: Uint8Array;
}
/** A lattice: displacement = stepM * integer, velocity = 32 stepM/s * integer, 3 an active node. */
export interface HairState {
  readonly level: LevelIndex;
  readonly stepM: number;
  readonly displacements: Int16Array;
  /** as many, or none: at rest */
  readonly velocities: Int16Array;
}
export interface AddCharacter {
  readonly type: "addCharacter";
  /** the client's own number, not 0 */
  readonly character: number;
  readonly groom: GroomHash;
  /** the finest that it is given */
  readonly level: LevelIndex;
  /** what it goes on from; null: its design */
  readonly state: HairState | null;
}
export interface SetLevel {
  readonly type: "setLevel";
  readonly character: number;
  readonly level: LevelIndex;
}
export interface RemoveCharacter {
  readonly type: "removeCharacter";
  readonly character: number;
}
export interface PoseSample {
  readonly character: number;
  /** u32; rises by any amount with each newer pose of the character, and wraps */
  readonly sequence: number;
  /** on the client's monotonic clock, the one in its envelopes */
  readonly captureTimeNs: number;
  /** does not continue from the pose before */
  readonly teleport: boolean;
  readonly pose: Pose;
}
export interface PoseBatch {
  readonly type: "poseBatch";
  readonly poses: readonly PoseSample[];
}
/** Factors on what a groom's materials say; gel is ether stiffness over mass, 1/s^2, and added. */
export interface MaterialScale {
  readonly stiffness: number;
  readonly damping: number;
  readonly density: number;
  readonly etherDamping: number;
  readonly airDrag: number;
  readonly gelPerS2: number;
}
export interface SetMaterial {
  readonly type: "setMaterial";
  readonly character: number;
  readonly scale: MaterialScale;
}
/** Metres, seconds, world axes. */
export interface Wind {
  readonly meanMPerS: readonly [number, number, number];
  readonly gustRatio: number;
  readonly gustPeriodS: number;
  readonly turbulenceRmsMPerS: number;
  readonly turbulenceScaleM: number;
  readonly seed: bigint;
}
export interface SetWind {
  readonly type: "setWind";
  readonly wind: Wind;
}
/** Which others of its room a session is sent, and how finely. */
export interface Observe {
  readonly type: "observe";
  readonly mode: ObserveMode;
  /** nearest: so many */
  readonly count: number;
  /** radius: heads within it */
  readonly radiusM: number;
  /** what nearest and radius are measured from, world; null: the session's own nearest head */
  readonly from: readonly [number, number, number] | null;
  /** list */
  readonly members: readonly number[];
  readonly errorClass: ErrorClass;
  /** ticks between frames, at least: 1, 2, 4 */
  readonly stride: number;
  /** of nodes, beside their displacements */
  readonly velocities: boolean;
}
export interface ReportImportance {
  readonly type: "reportImportance";
  readonly members: readonly MemberImportance[];
}
export interface RequestKeyframes {
  readonly type: "requestKeyframes";
  /** empty: of all */
  readonly members: readonly number[];
}
export interface GroomRequest {
  readonly type: "groomRequest";
  readonly hash: GroomHash;
  readonly offset: number;
}

export interface Welcome {
  readonly type: "welcome";
  readonly protocolVersion: number;
  readonly session: bigint;
  readonly tickRateHz: number;
  readonly tick: number;
  readonly characterCountMax: number;
  readonly groomBytesMax: number;
  readonly room: string;
  readonly secret: Uint8Array;
  /** the session that Hello named goes on, with its characters and grooms */
  readonly resumed: boolean;
  readonly resumeGraceS: number;
  /** a tick samples poses this far before its own time */
  readonly poseDelayNs: number;
}
export interface GroomNeed {
  readonly type: "groomNeed";
  readonly hash: GroomHash;
  readonly offset: number;
}
export interface GroomStatus {
  readonly type: "groomStatus";
  readonly hash: GroomHash;
  readonly state: GroomState;
}
export interface GroomData {
  readonly type: "groomData";
  readonly hash: GroomHash;
  readonly byteCount: number;
  readonly offset: number;
  readonly bytes: Uint8Array;
}
export interface CharacterAdded {
  readonly type: "characterAdded";
  readonly character: number;
  readonly groom: GroomHash;
  readonly level: LevelIndex;
  /** its number in frames */
  readonly member: number;
}
export interface CharacterRemoved {
  readonly type: "characterRemoved";
  readonly character: number;
}
export interface MemberJoined {
  readonly type: "memberJoined";
  readonly member: number;
  /** the owner's */
  readonly session: bigint;
  /** the owner's number for it */
  readonly character: number;
  readonly groom: GroomHash;
}
export interface MemberLeft {
  readonly type: "memberLeft";
  readonly member: number;
}
export interface LevelRecord {
  readonly type: "levelRecord";
  readonly groom: GroomHash;
  readonly level: LevelIndex;
  readonly geometry: LevelGeometry;
}
/** A frame as it travels, its content still coded. */
export interface CodedFrame {
  readonly member: number;
  readonly level: LevelIndex;
  readonly errorClass: ErrorClass;
  /** do not interpolate from the last frame */
  readonly discontinuous: boolean;
  /** no frame will come before the character wakes */
  readonly asleep: boolean;
  readonly velocities: boolean;
  /** 0 to 3: of the earlier frames that it refers to, `stride` ticks apart */
  readonly order: number;
  readonly stride: number;
  /** ticks from one step of the character to the next */
  readonly stepStride: number;
  readonly content: Uint8Array;
}
export interface CodedFrameBatch {
  readonly type: "frameBatch";
  readonly tick: number;
  /** server's clock: when the poses were sampled */
  readonly sampleTimeNs: number;
  /** members ascend */
  readonly frames: readonly CodedFrame[];
}
/** Something was refused. */
export interface ErrorMessage {
  readonly type: "error";
  readonly reason: ErrorReason;
  /** 0: none */
  readonly character: number;
  readonly groom: GroomHash | null;
  readonly detail: string;
}
export interface Goodbye {
  readonly type: "goodbye";
  readonly reason: GoodbyeReason;
  readonly detail: string;
}

export type ClientMessage =
  | Hello
  | GroomOffer
  | GroomChunk
  | AddCharacter
  | SetLevel
  | RemoveCharacter
  | PoseBatch
  | SetMaterial
  | SetWind
  | Observe
  | ReportImportance
  | RequestKeyframes
  | GroomRequest
  | Goodbye;

export type ServerMessage =
  | Welcome
  | GroomNeed
  | GroomStatus
  | GroomData
  | CharacterAdded
  | CharacterRemoved
  | MemberJoined
  | MemberLeft
  | LevelRecord
  | CodedFrameBatch
  | ErrorMessage
  | Goodbye;

export type Message = ClientMessage | ServerMessage;

/** The unit on every transport: a message and its sender's monotonic clock. */
export interface Envelope {
  readonly clockNs: number;
  readonly message: Message;
}

/** One line of what is wrong with a room's name, or null. */
export function roomFault(name: string): string | null {
  return /^[A-Za-z0-9._-]*$/.test(name) && name.length <= kRoomNameBytesMax ? null : kRoomNameRule;
}
