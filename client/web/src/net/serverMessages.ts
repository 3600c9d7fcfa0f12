import type * as fb from "./generated/messages";
import type { Appearance } from "../hair/appearance";
import type { LevelIndex } from "../hair/level";
import { appearanceOf, tagOf } from "./appearanceCodec";
import type { Goodbye } from "./clientMessages";
import { checkWind, windOf, type Wind } from "./roomMessages";
import { GroomState, kErrorReasonLast, type ErrorReason } from "../generated/enums";
import { decodeFrames, type CodedFrame } from "./frameBatch";
import type { GroomHash } from "./groomHash";
import { kGroomBytesMax, kGroomChunkBytesMax, kServersMax, kTickRateMaxHz } from "../generated/limits";
import { enumOf, hashOf, invalid, kUtf8, levelOf, secretOf, textOf, timeOf, type MessageReader } from "./messageCodec";

// What a server says to its client. A message is its interface, its reader below it, and its name in `ServersAlone` and
// `serverReaders` at the end. schema/PROTOCOL.md states bytes, states and reasons.
//
// Times are nanoseconds as numbers: exact to 104 days, to 256 ns at 73 years. Ticks and sizes are exact to 2^53.

export type { CodedFrame };

/** Where clients reach a server. */
export interface ServerAt {
  /** a name, or an address without brackets */
  readonly host: string;
  readonly port: number;
}

function serverAt(from: fb.ServerAt): ServerAt {
  const host = textOf(from.host(kUtf8), "a server's host");
  const port = from.port();
  if (!/^[A-Za-z0-9.:_-]+$/.test(host) || port === 0) throw invalid("no address of a server");
  return { host, port };
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
  /** the session; a moderator may forbid it later */
  readonly maySetWind: boolean;
  /** of the fleet, to ask when this one does not answer any more */
  readonly others: readonly ServerAt[];
  /** something comes from it in less than kSilenceMs, all the time */
  readonly signsOfLife: boolean;
}
const welcome: MessageReader<Welcome> = {
  read(from) {
    const resumeGraceS = from.resumeGraceS();
    if (!(resumeGraceS >= 0 && resumeGraceS <= 1e6)) throw invalid("welcome: grace out of range");
    const tickRateHz = from.tickRateHz();
    if (tickRateHz < 1 || tickRateHz > kTickRateMaxHz)
      throw invalid(`welcome: tick rate not in [1, ${kTickRateMaxHz}] Hz`);
    if (from.othersLength() > kServersMax) throw invalid(`welcome: more than ${kServersMax} servers`);
    return {
      protocolVersion: from.protocolVersion(),
      session: from.session(),
      tickRateHz,
      tick: Number(from.tick()),
      characterCountMax: from.characterCountMax(),
      groomBytesMax: Number(from.groomBytesMax()),
      room: textOf(from.room(kUtf8), "room"),
      secret: secretOf(from.secret()),
      resumed: from.resumed(),
      resumeGraceS,
      poseDelayNs: timeOf(from.poseDelayNs(), "welcome's pose delay"),
      maySetWind: from.maySetWind(),
      signsOfLife: from.signsOfLife(),
      others: Array.from({ length: from.othersLength() }, (_, i) => serverAt(from.others(i)!)),
    };
  },
};

/** To be sent from this offset on; the groom's size: all is there. */
export interface GroomNeed {
  readonly type: "groomNeed";
  readonly hash: GroomHash;
  readonly offset: number;
}
const groomNeed: MessageReader<GroomNeed> = {
  read: (from) => ({ hash: hashOf(from.hash()), offset: Number(from.offset()) }),
};

export interface GroomStatus {
  readonly type: "groomStatus";
  readonly hash: GroomHash;
  readonly state: GroomState;
}
const groomStatus: MessageReader<GroomStatus> = {
  read(from) {
    const state: GroomState = enumOf(from.state(), GroomState.queued, GroomState.refused, "groom state");
    return { hash: hashOf(from.hash()), state };
  },
};

/** The groom's bytes from `offset` on; pieces come in order. */
export interface GroomData {
  readonly type: "groomData";
  readonly hash: GroomHash;
  /** of the whole */
  readonly byteCount: number;
  readonly offset: number;
  readonly bytes: Uint8Array;
}
const groomData: MessageReader<GroomData> = {
  read(from) {
    const bytes = from.bytesArray()!;
    const byteCount = Number(from.byteCount());
    const offset = Number(from.offset());
    const isWithin = byteCount <= kGroomBytesMax && offset + bytes.length <= byteCount;
    if (!isWithin || bytes.length > kGroomChunkBytesMax) throw invalid("groom data: not within the groom");
    return { hash: hashOf(from.hash()), byteCount, offset, bytes: bytes.slice() };
  },
};

export interface CharacterAdded {
  readonly type: "characterAdded";
  readonly character: number;
  readonly groom: GroomHash;
  readonly level: LevelIndex;
  /** its number in frames */
  readonly member: number;
  /** counts the characters that have had this number, modulo 256; absent: 0 */
  readonly generation?: number;
}
const characterAdded: MessageReader<CharacterAdded> = {
  read(from) {
    const groom = hashOf(from.groom());
    const [member, generation] = [from.member(), from.generation()];
    return { character: from.character(), groom, level: levelOf(from.level()), member, generation };
  },
};

export interface CharacterRemoved {
  readonly type: "characterRemoved";
  readonly character: number;
}
const characterRemoved: MessageReader<CharacterRemoved> = {
  read: (from) => ({ character: from.character() }),
};

export interface MemberJoined {
  readonly type: "memberJoined";
  readonly member: number;
  /** the owner's */
  readonly session: bigint;
  /** the owner's number for it */
  readonly character: number;
  readonly groom: GroomHash;
  /** the owner's, as in `AddCharacter` */
  readonly tag: Uint8Array;
  /** the owner's; null: this client's default */
  readonly appearance: Appearance | null;
  /** counts the characters that have had this number, modulo 256; absent: 0 */
  readonly generation?: number;
}
const memberJoined: MessageReader<MemberJoined> = {
  read(from) {
    const groom = hashOf(from.groom());
    const tag = tagOf(from.tagArray());
    const appearance = appearanceOf(from.appearance());
    const [member, session, character] = [from.member(), from.session(), from.character()];
    return { member, session, character, groom, tag, appearance, generation: from.generation() };
  },
};

/** The newest tag and appearance of another client's character. */
export interface MemberChanged {
  readonly type: "memberChanged";
  readonly member: number;
  readonly tag: Uint8Array;
  readonly appearance: Appearance | null;
}
const memberChanged: MessageReader<MemberChanged> = {
  read: (from) => ({
    member: from.member(),
    tag: tagOf(from.tagArray()),
    appearance: appearanceOf(from.appearance()),
  }),
};

/** The wind in which the room's hair moves: when the session joins, and when it changes. */
export interface RoomWind {
  readonly type: "roomWind";
  readonly wind: Wind;
  /** who has set it; 0n: the server's setting; 2^64 - 1: a client of the server that had the room before */
  readonly session: bigint;
}
const roomWind: MessageReader<RoomWind> = {
  read(from) {
    const wind = windOf(from.wind()!, from.carried());
    checkWind(wind);
    return { wind, session: from.session() };
  },
};

export interface MemberLeft {
  readonly type: "memberLeft";
  readonly member: number;
}
const memberLeft: MessageReader<MemberLeft> = {
  read: (from) => ({ member: from.member() }),
};

/** The hash of a groom's basis, a file to ask for. Comes before the groom's first frame with coefficients. */
export interface GroomBasis {
  readonly type: "groomBasis";
  readonly groom: GroomHash;
  readonly basis: GroomHash;
}
const groomBasis: MessageReader<GroomBasis> = {
  read: (from) => ({ groom: hashOf(from.groom()), basis: hashOf(from.basis()) }),
};

/** The client may evaluate the groom's hair itself while it is on the learnt level. */
export interface GroomLearnt {
  readonly type: "groomLearnt";
  readonly groom: GroomHash;
  /** of the file, which GroomRequest asks for */
  readonly learnt: GroomHash;
}
const groomLearnt: MessageReader<GroomLearnt> = {
  read: (from) => ({ groom: hashOf(from.groom()), learnt: hashOf(from.learnt()) }),
};

export interface CodedFrameBatch {
  readonly type: "frameBatch";
  readonly tick: number;
  /** server's clock: when the poses were sampled */
  readonly sampleTimeNs: number;
  /** members ascend */
  readonly frames: readonly CodedFrame[];
  /** of the member of each frame, in a packet that may overtake its memberJoined or characterAdded; else empty */
  readonly generations: Uint8Array;
}
const kNoGenerations = new Uint8Array();
const frameBatch: MessageReader<CodedFrameBatch> = {
  read(from) {
    const frames = decodeFrames(from.framesArray()!);
    const generations = from.generationsArray() ?? kNoGenerations;
    if (generations.length > 0 && generations.length !== frames.length)
      throw invalid("frame batch: not a generation for each frame");
    const sampleTimeNs = timeOf(from.sampleTimeNs(), "frames' sample time");
    return { tick: Number(from.tick()), sampleTimeNs, frames, generations };
  },
};

/** To the server that holds the room: connect there, with a new session. */
export interface Redirect {
  readonly type: "redirect";
  /** null: nobody holds it for the moment; ask again where you asked first */
  readonly to: ServerAt | null;
}
const redirect: MessageReader<Redirect> = {
  read(from) {
    const to = from.to();
    return { to: to ? serverAt(to) : null };
  },
};

/** Something was refused. */
export interface ErrorMessage {
  readonly type: "error";
  readonly reason: ErrorReason;
  /** 0: none */
  readonly character: number;
  readonly groom: GroomHash | null;
  readonly detail: string;
}
const error: MessageReader<ErrorMessage> = {
  read(from) {
    const groom = from.groom();
    return {
      reason: enumOf(from.reason(), 1, kErrorReasonLast, "error reason"),
      character: from.character(),
      groom: groom ? hashOf(groom) : null,
      detail: textOf(from.detail(kUtf8), "error detail"),
    };
  },
};

/** `Goodbye` is either side's. */
type ServersAlone =
  | Welcome
  | GroomNeed
  | GroomStatus
  | GroomData
  | CharacterAdded
  | CharacterRemoved
  | MemberJoined
  | MemberChanged
  | MemberLeft
  | RoomWind
  | GroomBasis
  | GroomLearnt
  | CodedFrameBatch
  | Redirect
  | ErrorMessage;
export type ServerMessage = ServersAlone | Goodbye;

/** @internal Types of the package do not show generated code. */
export const serverReaders: { readonly [M in ServersAlone as M["type"]]: MessageReader<M> } = {
  welcome,
  groomNeed,
  groomStatus,
  groomData,
  characterAdded,
  characterRemoved,
  memberJoined,
  memberChanged,
  memberLeft,
  roomWind,
  groomBasis,
  groomLearnt,
  frameBatch,
  redirect,
  error,
};
