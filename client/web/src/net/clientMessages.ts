import { type GoodbyeReason, Role, kGoodbyeReasonLast } from "../generated/enums";
import { characterCodecs } from "./characterMessages";
import type {
  AddCharacter,
  PoseBatch,
  RemoveCharacter,
  SetAppearance,
  SetLevel,
  SetMaterial,
} from "./characterMessages";
import * as fb from "./generated/messages";
import { hashBytes, type GroomHash } from "./groomHash";
import {
  kGroomBytesMax,
  kGroomChunkBytesMax,
  kRoomNameBytesMax,
  kRoomNameRule,
  kTokenBytesMax,
} from "../generated/limits";
import {
  checkInteger,
  enumOf,
  hashOf,
  invalid,
  kUtf8,
  secretOf,
  textOf,
  words,
  writeHash,
  type ClientCodec,
} from "./messageCodec";
import { roomCodecs } from "./roomMessages";
import type { Moderate, Observe, ReportImportance, SetWind } from "./roomMessages";
import { fitText } from "./text";

// What a client says to its server: here who it is, its grooms and its goodbye. A message is its interface, its codec below
// it, and its name in `ClientMessage` and `clientCodecs` at the end. schema/PROTOCOL.md states bytes, states and limits.
//
// Times are nanoseconds as numbers: exact to 104 days, to 256 ns at 73 years. Offsets and sizes are exact to 2^53.

export type * from "./characterMessages";
export type * from "./roomMessages";

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
  /** the number in union Body of the last message that the client knows: the server sends none beyond it */
  readonly messageMax: number;
  /** that the client has followed to come here since its last welcome */
  readonly redirects: number;
  /** the last that the client knows; 0: only packets */
  readonly datagramLayout: number;
  /** of the client's whole way, over all servers, for their logs; 0: none */
  readonly trace: bigint;
  /** the server hears something of it in less than kSilenceMs, all the time */
  readonly signsOfLife: boolean;
}
/** Every client of this version knows these. */
const kMessageMaxLeast: number = fb.Body.GroomBasis;
/** @internal */
export const kMessageMax = Math.max(...Object.values(fb.Body).filter((value) => typeof value === "number"));

const hello: ClientCodec<Hello> = {
  write(to, message) {
    const name = to.createString(fitText(message.clientName));
    const room = to.createString(message.room);
    const token = to.createString(message.token);
    fb.Hello.startHello(to);
    fb.Hello.addProtocolVersion(to, message.protocolVersion);
    fb.Hello.addClientName(to, name);
    fb.Hello.addRoom(to, room);
    fb.Hello.addToken(to, token);
    fb.Hello.addRole(to, message.role);
    if (message.session !== 0n) {
      const [a, b] = words(message.secret);
      fb.Hello.addSession(to, message.session);
      fb.Hello.addSecret(to, fb.Secret.createSecret(to, a, b));
    }
    fb.Hello.addMessageMax(to, message.messageMax);
    fb.Hello.addRedirects(to, message.redirects);
    fb.Hello.addDatagramLayout(to, message.datagramLayout);
    fb.Hello.addTrace(to, message.trace);
    fb.Hello.addSignsOfLife(to, message.signsOfLife);
    return fb.Hello.endHello(to);
  },
  read(from) {
    const token = from.token(kUtf8) as Uint8Array | null;
    const messageMax = from.messageMax();
    if (messageMax < kMessageMaxLeast) throw invalid(`hello: message_max is below ${kMessageMaxLeast}`);
    if (token && token.length > kTokenBytesMax) throw invalid(`token: longer than ${kTokenBytesMax} bytes`);
    return {
      protocolVersion: from.protocolVersion(),
      clientName: textOf(from.clientName(kUtf8), "client name"),
      room: textOf(from.room(kUtf8), "room"),
      token: token ? new TextDecoder().decode(token) : "",
      role: enumOf(from.role(), Role.participant, Role.observer, "role"),
      session: from.session(),
      secret: secretOf(from.secret()),
      messageMax,
      redirects: from.redirects(),
      datagramLayout: from.datagramLayout(),
      trace: from.trace(),
      signsOfLife: from.signsOfLife(),
    };
  },
  check({ room, token, role, secret, messageMax, redirects, datagramLayout, trace }) {
    if (!/^[A-Za-z0-9._-]*$/.test(room) || room.length > kRoomNameBytesMax) throw invalid(kRoomNameRule);
    if (new TextEncoder().encode(token).length > kTokenBytesMax)
      throw invalid(`token: longer than ${kTokenBytesMax} bytes`);
    checkInteger(role, Role.participant, Role.observer, "role");
    if (secret.length !== 16) throw invalid("secret: not 16 bytes");
    checkInteger(messageMax, kMessageMaxLeast, 255, "message_max");
    checkInteger(redirects, 0, 255, "redirects");
    checkInteger(datagramLayout, 0, 255, "datagram_layout");
    if (trace !== BigInt.asUintN(64, trace)) throw invalid("trace: not a number of 64 bits");
  },
};

export interface GroomOffer {
  readonly type: "groomOffer";
  readonly hash: GroomHash;
  readonly byteCount: number;
}
const groomOffer: ClientCodec<GroomOffer> = {
  write(to, { hash, byteCount }) {
    fb.GroomOffer.startGroomOffer(to);
    fb.GroomOffer.addHash(to, writeHash(to, hash));
    fb.GroomOffer.addByteCount(to, BigInt(byteCount));
    return fb.GroomOffer.endGroomOffer(to);
  },
  read(from) {
    const byteCount = Number(from.byteCount());
    if (byteCount === 0) throw invalid("groom offer: no bytes");
    return { hash: hashOf(from.hash()), byteCount };
  },
  check({ hash, byteCount }) {
    hashBytes(hash);
    checkInteger(byteCount, 1, kGroomBytesMax, "groom's bytes");
  },
};

export interface GroomChunk {
  readonly type: "groomChunk";
  readonly hash: GroomHash;
  readonly offset: number;
  readonly bytes: Uint8Array;
}
const groomChunk: ClientCodec<GroomChunk> = {
  write(to, message) {
    const bytes = to.createByteVector(message.bytes);
    fb.GroomChunk.startGroomChunk(to);
    fb.GroomChunk.addHash(to, writeHash(to, message.hash));
    fb.GroomChunk.addOffset(to, BigInt(message.offset));
    fb.GroomChunk.addBytes(to, bytes);
    return fb.GroomChunk.endGroomChunk(to);
  },
  read(from) {
    const bytes = from.bytesArray()!;
    if (bytes.length === 0 || bytes.length > kGroomChunkBytesMax)
      throw invalid(`groom chunk: ${bytes.length} bytes, not in [1, ${kGroomChunkBytesMax}]`);
    return { hash: hashOf(from.hash()), offset: Number(from.offset()), bytes: bytes.slice() };
  },
  check({ hash, offset, bytes }) {
    hashBytes(hash);
    checkInteger(offset, 0, kGroomBytesMax, "chunk's offset");
    checkInteger(bytes.length, 1, kGroomChunkBytesMax, "chunk's bytes");
  },
};

/** Another's groom, which the client lacks; answered by GroomData. */
export interface GroomRequest {
  readonly type: "groomRequest";
  readonly hash: GroomHash;
  readonly offset: number;
}
const groomRequest: ClientCodec<GroomRequest> = {
  write(to, { hash, offset }) {
    fb.GroomRequest.startGroomRequest(to);
    fb.GroomRequest.addHash(to, writeHash(to, hash));
    fb.GroomRequest.addOffset(to, BigInt(offset));
    return fb.GroomRequest.endGroomRequest(to);
  },
  read: (from) => ({ hash: hashOf(from.hash()), offset: Number(from.offset()) }),
  check({ hash, offset }) {
    hashBytes(hash);
    checkInteger(offset, 0, kGroomBytesMax, "request's offset");
  },
};

/** The client has the file of GroomLearnt: frames of such hair need no coefficients. */
export interface EvaluateLearnt {
  readonly type: "evaluateLearnt";
  readonly groom: GroomHash;
  readonly learnt: GroomHash;
}
const evaluateLearnt: ClientCodec<EvaluateLearnt> = {
  write(to, { groom, learnt }) {
    fb.EvaluateLearnt.startEvaluateLearnt(to);
    fb.EvaluateLearnt.addGroom(to, writeHash(to, groom));
    fb.EvaluateLearnt.addLearnt(to, writeHash(to, learnt));
    return fb.EvaluateLearnt.endEvaluateLearnt(to);
  },
  read: (from) => ({ groom: hashOf(from.groom()), learnt: hashOf(from.learnt()) }),
  check({ groom, learnt }) {
    hashBytes(groom);
    hashBytes(learnt);
  },
};

/** The last message of either side. */
export interface Goodbye {
  readonly type: "goodbye";
  readonly reason: GoodbyeReason;
  readonly detail: string;
}
const goodbye: ClientCodec<Goodbye> = {
  write: (to, { reason, detail }) => fb.Goodbye.createGoodbye(to, to.createString(fitText(detail)), reason),
  read: (from) => ({
    reason: enumOf(from.reason(), 1, kGoodbyeReasonLast, "goodbye reason"),
    detail: textOf(from.detail(kUtf8), "goodbye detail"),
  }),
  check() {},
};

export type ClientMessage =
  | Hello
  | GroomOffer
  | GroomChunk
  | AddCharacter
  | SetLevel
  | RemoveCharacter
  | PoseBatch
  | SetMaterial
  | SetAppearance
  | SetWind
  | Observe
  | ReportImportance
  | GroomRequest
  | EvaluateLearnt
  | Moderate
  | Goodbye;

/** @internal Types of the package do not show generated code. */
export const clientCodecs: { readonly [M in ClientMessage as M["type"]]: ClientCodec<M> } = {
  hello,
  groomOffer,
  groomChunk,
  ...characterCodecs,
  ...roomCodecs,
  groomRequest,
  evaluateLearnt,
  goodbye,
};

/** @internal */
export function codecOf(message: ClientMessage): ClientCodec<ClientMessage> {
  return clientCodecs[message.type] as ClientCodec<ClientMessage>;
}

/** Throws `HairnetError` unless the message can be sent as it is and a server may take it. */
export function validateMessage(message: ClientMessage): void {
  codecOf(message).check(message);
}
