import type { MemberImportance } from "../hair/hairSource";
import { ErrorClass, type LevelIndex } from "../hair/level";
import { kPoseNumbers, validatePose, type Pose } from "../hair/pose";
import { type GoodbyeReason, ModerateAction, ObserveMode, Role, kGoodbyeReasonLast } from "../generated/enums";
import * as fb from "./generated/messages";
import { hashBytes, type GroomHash } from "./groomHash";
import { checkState, readState, writeState, type HairState } from "./hairState";
import {
  kGroomBytesMax,
  kGroomChunkBytesMax,
  kMembersPerMessageMax,
  kObserveRadiusMaxM,
  kPosesPerBatchMax,
  kPositionMaxM,
  kRoomNameBytesMax,
  kRoomNameRule,
  kScreenHeightMax,
  kTimeMaxNs,
  kTokenBytesMax,
} from "../generated/limits";
import {
  checkCharacter,
  checkInteger,
  checkLevel,
  checkMember,
  checkMembers,
  checkNumbers,
  enumOf,
  hashOf,
  invalid,
  kUtf8,
  levelOf,
  membersOf,
  secretOf,
  textOf,
  timeOf,
  vectorOf,
  wholeNs,
  words,
  writeHash,
  type Builder,
  type ClientCodec,
} from "./messageCodec";
import { fitText } from "./text";

// What a client says to its server. A message is its interface, its codec below it, and its name in `ClientMessage` and
// `clientCodecs` at the end. schema/PROTOCOL.md states bytes, states and limits.
//
// Times are nanoseconds as numbers: exact to 104 days, to 256 ns at 73 years. Offsets and sizes are exact to 2^53.

export type { HairState, MemberImportance };

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
    return fb.Hello.endHello(to);
  },
  read(from) {
    const token = from.token(kUtf8) as Uint8Array | null;
    if (token && token.length > kTokenBytesMax) throw invalid(`token: longer than ${kTokenBytesMax} bytes`);
    return {
      protocolVersion: from.protocolVersion(),
      clientName: textOf(from.clientName(kUtf8), "client name"),
      room: textOf(from.room(kUtf8), "room"),
      token: token ? new TextDecoder().decode(token) : "",
      role: enumOf(from.role(), Role.participant, Role.observer, "role"),
      session: from.session(),
      secret: secretOf(from.secret()),
    };
  },
  check({ room, token, role, secret }) {
    if (!/^[A-Za-z0-9._-]*$/.test(room) || room.length > kRoomNameBytesMax) throw invalid(kRoomNameRule);
    if (new TextEncoder().encode(token).length > kTokenBytesMax)
      throw invalid(`token: longer than ${kTokenBytesMax} bytes`);
    checkInteger(role, Role.participant, Role.observer, "role");
    if (secret.length !== 16) throw invalid("secret: not 16 bytes");
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
const addCharacter: ClientCodec<AddCharacter> = {
  write(to, message) {
    const state = message.state ? writeState(to, message.state) : 0;
    fb.AddCharacter.startAddCharacter(to);
    fb.AddCharacter.addGroom(to, writeHash(to, message.groom));
    fb.AddCharacter.addCharacter(to, message.character);
    fb.AddCharacter.addLevel(to, message.level);
    if (state !== 0) fb.AddCharacter.addState(to, state);
    return fb.AddCharacter.endAddCharacter(to);
  },
  read(from) {
    const groom = hashOf(from.groom());
    const level = levelOf(from.level());
    const state = from.state();
    return { character: from.character(), groom, level, state: state && readState(state) };
  },
  check({ character, groom, level, state }) {
    checkCharacter(character);
    hashBytes(groom);
    checkLevel(level);
    if (state) checkState(state);
  },
};

/** The finest level that a character may have. */
export interface SetLevel {
  readonly type: "setLevel";
  readonly character: number;
  readonly level: LevelIndex;
}
const setLevel: ClientCodec<SetLevel> = {
  write: (to, { character, level }) => fb.SetLevel.createSetLevel(to, character, level),
  read: (from) => ({ character: from.character(), level: levelOf(from.level()) }),
  check({ character, level }) {
    checkCharacter(character);
    checkLevel(level);
  },
};

export interface RemoveCharacter {
  readonly type: "removeCharacter";
  readonly character: number;
}
const removeCharacter: ClientCodec<RemoveCharacter> = {
  write: (to, { character }) => fb.RemoveCharacter.createRemoveCharacter(to, character),
  read: (from) => ({ character: from.character() }),
  check: ({ character }) => checkCharacter(character),
};

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

/** A struct PoseSample, from its end as builders write; the 35 numbers of a `Pose` lie in its order. */
function writePose(to: Builder, sample: PoseSample): void {
  to.prep(8, fb.PoseSample.sizeOf());
  to.pad(3);
  to.writeInt8(sample.teleport ? 1 : 0);
  for (let i = sample.pose.length - 1; i >= 0; --i) to.writeFloat32(sample.pose[i]);
  to.writeInt32(sample.sequence);
  to.writeInt32(sample.character);
  to.writeInt64(wholeNs(sample.captureTimeNs));
}

function readBones(bones: fb.Bones): Pose {
  const pose = new Float64Array(kPoseNumbers);
  for (let i = 0; i < kPoseNumbers; ++i) pose[i] = bones.bb!.readFloat32(bones.bb_pos + 4 * i);
  return pose;
}

/** Throws `HairnetError` unless a server may take it. */
export function validatePoseSample(sample: PoseSample): void {
  checkCharacter(sample.character);
  checkInteger(sample.sequence, 0, 0xffffffff, "pose's sequence");
  if (!(Math.abs(sample.captureTimeNs) <= kTimeMaxNs)) throw invalid("pose's capture time: out of range");
  validatePose(sample.pose);
}

export interface PoseBatch {
  readonly type: "poseBatch";
  readonly poses: readonly PoseSample[];
}
const poseBatch: ClientCodec<PoseBatch> = {
  write(to, { poses }) {
    fb.PoseBatch.startPosesVector(to, poses.length);
    for (let i = poses.length - 1; i >= 0; --i) writePose(to, poses[i]);
    return fb.PoseBatch.createPoseBatch(to, to.endVector());
  },
  read(from) {
    const count = from.posesLength();
    if (count > kPosesPerBatchMax) throw invalid(`pose batch: ${count} poses, more than ${kPosesPerBatchMax}`);
    const sample = new fb.PoseSample();
    const bones = new fb.Bones();
    const poses: PoseSample[] = [];
    for (let i = 0; i < count; ++i) {
      const p = from.poses(i, sample)!;
      poses.push({
        character: p.character(),
        sequence: p.sequence(),
        captureTimeNs: timeOf(p.captureTimeNs(), "pose's capture time"),
        teleport: p.teleport(),
        pose: readBones(p.bones(bones)!),
      });
    }
    return { poses };
  },
  check({ poses }) {
    checkInteger(poses.length, 0, kPosesPerBatchMax, "poses of a batch");
    poses.forEach(validatePoseSample);
  },
};

/** Factors on the values of a groom's materials; gel is ether stiffness over mass, 1/s^2, and added. */
export interface MaterialScale {
  readonly stiffness: number;
  readonly damping: number;
  readonly density: number;
  readonly etherDamping: number;
  readonly airDrag: number;
  readonly gelPerS2: number;
}
/** Refused with an error message when out of range. */
export interface SetMaterial {
  readonly type: "setMaterial";
  readonly character: number;
  readonly scale: MaterialScale;
}
const setMaterial: ClientCodec<SetMaterial> = {
  resent: "character",
  write(to, { character, scale: s }) {
    fb.SetMaterial.startSetMaterial(to);
    fb.SetMaterial.addScale(
      to,
      fb.MaterialScale.createMaterialScale(
        to,
        s.stiffness,
        s.damping,
        s.density,
        s.etherDamping,
        s.airDrag,
        s.gelPerS2,
      ),
    );
    fb.SetMaterial.addCharacter(to, character);
    return fb.SetMaterial.endSetMaterial(to);
  },
  read(from) {
    const s = from.scale()!;
    return {
      character: from.character(),
      scale: {
        stiffness: s.stiffness(),
        damping: s.damping(),
        density: s.density(),
        etherDamping: s.etherDamping(),
        airDrag: s.airDrag(),
        gelPerS2: s.gelPerS2(),
      },
    };
  },
  check({ character, scale }) {
    checkCharacter(character);
    checkNumbers(Object.values(scale), "material");
  },
};

/** Metres, seconds, world axes. */
export interface Wind {
  readonly meanMPerS: readonly [number, number, number];
  readonly gustRatio: number;
  readonly gustPeriodS: number;
  readonly turbulenceRmsMPerS: number;
  readonly turbulenceScaleM: number;
  readonly seed: bigint;
}
/** The wind of the whole room; the last client to set it wins. */
export interface SetWind {
  readonly type: "setWind";
  readonly wind: Wind;
}
const setWind: ClientCodec<SetWind> = {
  resent: "session",
  write(to, { wind: w }) {
    const [x, y, z] = w.meanMPerS;
    fb.SetWind.startSetWind(to);
    fb.SetWind.addWind(
      to,
      fb.Wind.createWind(
        to,
        x,
        y,
        z,
        w.gustRatio,
        w.gustPeriodS,
        w.turbulenceRmsMPerS,
        w.turbulenceScaleM,
        BigInt.asUintN(64, w.seed),
      ),
    );
    return fb.SetWind.endSetWind(to);
  },
  read(from) {
    const w = from.wind()!;
    return {
      wind: {
        meanMPerS: [w.meanX(), w.meanY(), w.meanZ()],
        gustRatio: w.gustRatio(),
        gustPeriodS: w.gustPeriodS(),
        turbulenceRmsMPerS: w.turbulenceRmsMPerS(),
        turbulenceScaleM: w.turbulenceScaleM(),
        seed: w.seed(),
      },
    };
  },
  check({ wind: { seed, meanMPerS, ...numbers } }) {
    if (typeof seed !== "bigint") throw invalid("wind: the seed is no bigint");
    if (meanMPerS.length !== 3) throw invalid("wind: its mean is not 3 numbers");
    checkNumbers([...meanMPerS, ...Object.values(numbers)], "wind");
  },
};

/** Which others of its room a session is sent, and how finely; every frame of all at first. */
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
const observe: ClientCodec<Observe> = {
  resent: "session",
  write(to, message) {
    const members = fb.Observe.createMembersVector(to, message.members as number[]);
    fb.Observe.startObserve(to);
    fb.Observe.addMembers(to, members);
    if (message.from) fb.Observe.addFrom(to, fb.Vec3.createVec3(to, ...message.from));
    fb.Observe.addCount(to, message.count);
    fb.Observe.addRadiusM(to, message.radiusM);
    fb.Observe.addStride(to, message.stride);
    fb.Observe.addMode(to, message.mode);
    fb.Observe.addErrorClass(to, message.errorClass);
    fb.Observe.addVelocities(to, message.velocities);
    return fb.Observe.endObserve(to);
  },
  read(from) {
    const origin = from.from();
    return {
      mode: enumOf(from.mode(), ObserveMode.all, ObserveMode.list, "observe mode"),
      count: from.count(),
      radiusM: from.radiusM(),
      from: origin ? vectorOf(origin) : null,
      members: membersOf(from.membersArray(), "observe"),
      errorClass: enumOf(from.errorClass(), ErrorClass.quarterMm, ErrorClass.oneMm, "error class"),
      stride: from.stride(),
      velocities: from.velocities(),
    };
  },
  check({ mode, count, radiusM, from, members, errorClass, stride }) {
    checkInteger(mode, ObserveMode.all, ObserveMode.list, "observe mode");
    checkInteger(count, 0, 0xffffffff, "observed count");
    checkInteger(errorClass, ErrorClass.quarterMm, ErrorClass.oneMm, "error class");
    checkMembers(members, "observed members");
    if (![1, 2, 4].includes(stride)) throw invalid("observe: stride is not 1, 2 or 4");
    if (!(radiusM >= 0 && radiusM <= kObserveRadiusMaxM))
      throw invalid(`observe: radius not in [0, ${kObserveRadiusMaxM}] m`);
    const near = (x: number) => Math.abs(x) <= kPositionMaxM;
    if (from && !(from.length === 3 && from.every(near)))
      throw invalid("observe: the point it is measured from is not finite or too far away");
  },
};

function checkScreenHeight(screenHeight: number): void {
  if (!(screenHeight >= 0 && screenHeight <= kScreenHeightMax))
    throw invalid(`importance: screen height not in [0, ${kScreenHeightMax}]`);
}

export interface ReportImportance {
  readonly type: "reportImportance";
  readonly members: readonly MemberImportance[];
}
const reportImportance: ClientCodec<ReportImportance> = {
  write(to, { members }) {
    fb.ReportImportance.startMembersVector(to, members.length);
    for (let i = members.length - 1; i >= 0; --i) {
      const each = members[i];
      fb.MemberImportance.createMemberImportance(to, each.member, each.screenHeight, each.inView);
    }
    return fb.ReportImportance.createReportImportance(to, to.endVector());
  },
  read(from) {
    const count = from.membersLength();
    if (count > kMembersPerMessageMax) throw invalid(`importance: more than ${kMembersPerMessageMax} members`);
    const members: MemberImportance[] = [];
    for (let i = 0; i < count; ++i) {
      const each = from.members(i)!;
      checkScreenHeight(each.screenHeight());
      members.push({ member: each.member(), screenHeight: each.screenHeight(), inView: each.inView() });
    }
    return { members };
  },
  check({ members }) {
    checkInteger(members.length, 0, kMembersPerMessageMax, "members of a report");
    for (const { member, screenHeight } of members) {
      checkMember(member);
      checkScreenHeight(screenHeight);
    }
  },
};

export interface RequestKeyframes {
  readonly type: "requestKeyframes";
  /** empty: of all */
  readonly members: readonly number[];
}
const requestKeyframes: ClientCodec<RequestKeyframes> = {
  write(to, message) {
    const members = fb.RequestKeyframes.createMembersVector(to, message.members as number[]);
    return fb.RequestKeyframes.createRequestKeyframes(to, members);
  },
  read: (from) => ({ members: membersOf(from.membersArray(), "keyframes") }),
  check: ({ members }) => checkMembers(members, "members of a request"),
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

/** What a moderator does in its room. A person is named by `session` or, if that is 0, by `subject`. */
export interface Moderate {
  readonly type: "moderate";
  readonly action: ModerateAction;
  /** the owner of a member, as MemberJoined names it */
  readonly session: bigint;
  /** as the server's log names it: "sub:alice" */
  readonly subject: string;
  /** of the ban after a removal; 0: none */
  readonly seconds: number;
  /** for people and the log */
  readonly reason: string;
}
const moderate: ClientCodec<Moderate> = {
  write(to, { action, session, subject, seconds, reason }) {
    const subjectAt = to.createString(fitText(subject));
    const reasonAt = to.createString(fitText(reason));
    return fb.Moderate.createModerate(to, subjectAt, reasonAt, session, seconds, action);
  },
  read: (from) => ({
    action: enumOf(from.action(), ModerateAction.remove, ModerateAction.unlock, "moderation"),
    session: from.session(),
    subject: textOf(from.subject(kUtf8), "subject"),
    seconds: from.seconds(),
    reason: textOf(from.reason(kUtf8), "reason"),
  }),
  check({ action, seconds }) {
    checkInteger(action, ModerateAction.remove, ModerateAction.unlock, "moderation");
    checkInteger(seconds, 0, 0xffffffff, "seconds of a ban");
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
  | SetWind
  | Observe
  | ReportImportance
  | RequestKeyframes
  | GroomRequest
  | Moderate
  | Goodbye;

/** @internal Types of the package do not show generated code. */
export const clientCodecs: { readonly [M in ClientMessage as M["type"]]: ClientCodec<M> } = {
  hello,
  groomOffer,
  groomChunk,
  addCharacter,
  setLevel,
  removeCharacter,
  poseBatch,
  setMaterial,
  setWind,
  observe,
  reportImportance,
  requestKeyframes,
  groomRequest,
  moderate,
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
