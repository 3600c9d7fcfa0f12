import * as flatbuffers from "flatbuffers";
import { HairnetError } from "../hair/hairnetError";
import { ErrorClass, LevelIndex } from "../hair/level";
import { validateGeometry } from "../hair/lattice";
import type { Pose } from "../hair/pose";
import { kPoseNumbers } from "../hair/pose";
import { decodeFrames } from "./frameBatch";
import { layouts } from "./generated/layout";
import * as fb from "./generated/messages";
import { toHex } from "./groomHash";
import type * as m from "./messages";
import {
  GroomState,
  ObserveMode,
  Role,
  kErrorReasonLast,
  kGoodbyeReasonLast,
  kGroomBytesMax,
  kGroomChunkBytesMax,
  kHairStateIntegersMax,
  kMembersPerMessageMax,
  kPacketBytesMax,
  kPosesPerBatchMax,
  kScreenHeightMax,
  kTickRateMaxHz,
  kTimeMaxNs,
  kTokenBytesMax,
} from "./messages";
import { decodeText, kTextBytesMax } from "./text";
import { verifyBuffer } from "./verify";

const kTimeMax = BigInt(kTimeMaxNs);
const kUtf8 = flatbuffers.Encoding.UTF8_BYTES;

/**
 * Decodes exactly one packet, size prefix included: verified, its values checked, then copied out; nothing of what is
 * returned lies in `packet`, but the contents of frames may. Throws `HairnetError` and nothing else. Values of poses,
 * materials and winds are not judged here: each is a matter of its own.
 */
export function decodePacket(packet: Uint8Array): m.Envelope {
  if (packet.length > kPacketBytesMax)
    throw new HairnetError("too_large", `packet of ${packet.length} bytes, more than ${kPacketBytesMax}`);
  // Vectors of numbers are read where they lie.
  const aligned = packet.byteOffset % 8 === 0 ? packet : packet.slice();
  verifyBuffer(aligned, "HNET", "Envelope", layouts);
  const root = fb.Envelope.getSizePrefixedRootAsEnvelope(new flatbuffers.ByteBuffer(aligned));
  const clockNs = timeOf(root.clockNs(), "envelope's clock");
  return { clockNs, message: readBody(root) };
}

function readBody(envelope: fb.Envelope): m.Message {
  const as = <T>(table: T): T => envelope.body(table) as T;
  switch (envelope.bodyType()) {
    case fb.Body.Hello:
      return readHello(as(new fb.Hello()));
    case fb.Body.GroomOffer:
      return readGroomOffer(as(new fb.GroomOffer()));
    case fb.Body.GroomChunk:
      return readGroomChunk(as(new fb.GroomChunk()));
    case fb.Body.AddCharacter:
      return readAddCharacter(as(new fb.AddCharacter()));
    case fb.Body.SetLevel:
      return readSetLevel(as(new fb.SetLevel()));
    case fb.Body.RemoveCharacter:
      return { type: "removeCharacter", character: as(new fb.RemoveCharacter()).character() };
    case fb.Body.PoseBatch:
      return readPoseBatch(as(new fb.PoseBatch()));
    case fb.Body.Welcome:
      return readWelcome(as(new fb.Welcome()));
    case fb.Body.GroomNeed:
      return readGroomNeed(as(new fb.GroomNeed()));
    case fb.Body.GroomStatus:
      return readGroomStatus(as(new fb.GroomStatus()));
    case fb.Body.CharacterAdded:
      return readCharacterAdded(as(new fb.CharacterAdded()));
    case fb.Body.CharacterRemoved:
      return { type: "characterRemoved", character: as(new fb.CharacterRemoved()).character() };
    case fb.Body.LevelRecord:
      return readLevelRecord(as(new fb.LevelRecord()));
    case fb.Body.FrameBatch:
      return readFrameBatch(as(new fb.FrameBatch()));
    case fb.Body.Error:
      return readError(as(new fb.Error()));
    case fb.Body.Goodbye:
      return readGoodbye(as(new fb.Goodbye()));
    case fb.Body.SetMaterial:
      return readSetMaterial(as(new fb.SetMaterial()));
    case fb.Body.SetWind:
      return readSetWind(as(new fb.SetWind()));
    case fb.Body.Observe:
      return readObserve(as(new fb.Observe()));
    case fb.Body.ReportImportance:
      return readReportImportance(as(new fb.ReportImportance()));
    case fb.Body.RequestKeyframes:
      return readRequestKeyframes(as(new fb.RequestKeyframes()));
    case fb.Body.GroomRequest:
      return readGroomRequest(as(new fb.GroomRequest()));
    case fb.Body.GroomData:
      return readGroomData(as(new fb.GroomData()));
    case fb.Body.MemberJoined:
      return readMemberJoined(as(new fb.MemberJoined()));
    case fb.Body.MemberLeft:
      return { type: "memberLeft", member: as(new fb.MemberLeft()).member() };
    default:
      throw invalid("no message of a kind that this version knows");
  }
}

function invalid(why: string): HairnetError {
  return new HairnetError("invalid", why);
}

function timeOf(ns: bigint, name: string): number {
  if (ns < -kTimeMax || ns > kTimeMax) throw invalid(`${name}: out of range`);
  return Number(ns);
}

function textOf(bytes: string | Uint8Array | null, name: string): string {
  if (bytes === null) return "";
  const text = decodeText(bytes as Uint8Array);
  if (text === null)
    throw invalid(`${name}: not UTF-8 of at most ${kTextBytesMax} bytes free of control characters`);
  return text;
}

function enumOf(value: number, first: number, last: number, name: string): number {
  if (value < first || value > last) throw invalid(`${name} ${value} does not exist`);
  return value;
}

const levelOf = (value: number): LevelIndex => enumOf(value, LevelIndex.high, LevelIndex.rigid, "level");

/** The bytes of a struct that has no other meaning. */
function bytesAt(struct: { bb: flatbuffers.ByteBuffer | null; bb_pos: number } | null, count: number): Uint8Array {
  return struct ? struct.bb!.bytes().slice(struct.bb_pos, struct.bb_pos + count) : new Uint8Array(count);
}

const hashOf = (hash: fb.Hash | null): string => toHex(bytesAt(hash, 32));
const secretOf = (secret: fb.Secret | null): Uint8Array => bytesAt(secret, 16);

function vectorOf(vector: fb.Vec3): [number, number, number] {
  return [vector.x(), vector.y(), vector.z()];
}

function membersOf(members: Uint32Array | null, name: string): number[] {
  if (members!.length > kMembersPerMessageMax) throw invalid(`${name}: more than ${kMembersPerMessageMax} members`);
  return Array.from(members!);
}

function readHello(from: fb.Hello): m.Hello {
  const token = from.token(kUtf8) as Uint8Array | null;
  if (token && token.length > kTokenBytesMax) throw invalid(`token: longer than ${kTokenBytesMax} bytes`);
  return {
    type: "hello",
    protocolVersion: from.protocolVersion(),
    clientName: textOf(from.clientName(kUtf8), "client name"),
    room: textOf(from.room(kUtf8), "room"),
    token: token ? new TextDecoder().decode(token) : "",
    role: enumOf(from.role(), Role.participant, Role.observer, "role"),
    session: from.session(),
    secret: secretOf(from.secret()),
  };
}

function readGroomOffer(from: fb.GroomOffer): m.GroomOffer {
  const byteCount = Number(from.byteCount());
  if (byteCount === 0) throw invalid("groom offer: no bytes");
  return { type: "groomOffer", hash: hashOf(from.hash()), byteCount };
}

function readGroomChunk(from: fb.GroomChunk): m.GroomChunk {
  const bytes = from.bytesArray()!;
  if (bytes.length === 0 || bytes.length > kGroomChunkBytesMax)
    throw invalid(`groom chunk: ${bytes.length} bytes, not in [1, ${kGroomChunkBytesMax}]`);
  return { type: "groomChunk", hash: hashOf(from.hash()), offset: Number(from.offset()), bytes: bytes.slice() };
}

function readHairState(from: fb.HairState | null): m.HairState | null {
  if (!from) return null;
  const count = from.displacementsLength();
  if (count > kHairStateIntegersMax) throw invalid(`hair state: more than ${kHairStateIntegersMax} integers`);
  if (from.velocitiesLength() !== 0 && from.velocitiesLength() !== count) throw invalid("hair state: counts differ");
  return {
    level: enumOf(from.level(), LevelIndex.high, LevelIndex.ether, "level of a hair state"),
    stepM: from.stepM(),
    displacements: from.displacementsArray()!.slice(),
    velocities: from.velocitiesArray()!.slice(),
  };
}

function readAddCharacter(from: fb.AddCharacter): m.AddCharacter {
  return {
    type: "addCharacter",
    character: from.character(),
    groom: hashOf(from.groom()),
    level: levelOf(from.level()),
    state: readHairState(from.state()),
  };
}

function readSetLevel(from: fb.SetLevel): m.SetLevel {
  return { type: "setLevel", character: from.character(), level: levelOf(from.level()) };
}

function readPoseBatch(from: fb.PoseBatch): m.PoseBatch {
  const count = from.posesLength();
  if (count > kPosesPerBatchMax) throw invalid(`pose batch: ${count} poses, more than ${kPosesPerBatchMax}`);
  const sample = new fb.PoseSample();
  const bones = new fb.Bones();
  const poses: m.PoseSample[] = [];
  for (let i = 0; i < count; ++i) {
    const p = from.poses(i, sample)!;
    poses.push({
      character: p.character(),
      sequence: p.sequence(),
      captureTimeNs: timeOf(p.captureTimeNs(), "pose's capture time"),
      teleport: p.teleport(),
      pose: poseOf(p.bones(bones)!),
    });
  }
  return { type: "poseBatch", poses };
}

/** Bones are 35 floats in the order of a `Pose`. */
function poseOf(bones: fb.Bones): Pose {
  const pose = new Float64Array(kPoseNumbers);
  for (let i = 0; i < kPoseNumbers; ++i) pose[i] = bones.bb!.readFloat32(bones.bb_pos + 4 * i);
  return pose;
}

function readWelcome(from: fb.Welcome): m.Welcome {
  const resumeGraceS = from.resumeGraceS();
  if (!(resumeGraceS >= 0 && resumeGraceS <= 1e6)) throw invalid("welcome: grace out of range");
  const tickRateHz = from.tickRateHz();
  if (tickRateHz < 1 || tickRateHz > kTickRateMaxHz)
    throw invalid(`welcome: tick rate not in [1, ${kTickRateMaxHz}] Hz`);
  return {
    type: "welcome",
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
  };
}

function readGroomNeed(from: fb.GroomNeed): m.GroomNeed {
  return { type: "groomNeed", hash: hashOf(from.hash()), offset: Number(from.offset()) };
}

function readGroomStatus(from: fb.GroomStatus): m.GroomStatus {
  const state: GroomState = enumOf(from.state(), GroomState.queued, GroomState.refused, "groom state");
  return { type: "groomStatus", hash: hashOf(from.hash()), state };
}

function readCharacterAdded(from: fb.CharacterAdded): m.CharacterAdded {
  return {
    type: "characterAdded",
    character: from.character(),
    groom: hashOf(from.groom()),
    level: levelOf(from.level()),
    member: from.member(),
  };
}

function readLevelRecord(from: fb.LevelRecord): m.LevelRecord {
  const geometry = {
    lattice: {
      origin: new Float32Array(vectorOf(from.origin()!)),
      spacing: new Float32Array(vectorOf(from.spacing()!)),
      dims: [from.nodeCountX(), from.nodeCountY(), from.nodeCountZ()] as const,
    },
    activeNodes: from.activeNodesArray()!.slice(),
    trimmedNodes: from.trimmedNodesArray()!.slice(),
    trimmedBegin: from.trimmedBeginArray()!.slice(),
    trimmedFrom: from.trimmedFromArray()!.slice(),
    trimmedWeights: from.trimmedWeightsArray()!.slice(),
  };
  validateGeometry(geometry);
  return {
    type: "levelRecord",
    groom: hashOf(from.groom()),
    level: enumOf(from.level(), LevelIndex.high, LevelIndex.ether, "level of a level record"),
    geometry,
  };
}

function readFrameBatch(from: fb.FrameBatch): m.CodedFrameBatch {
  return {
    type: "frameBatch",
    tick: Number(from.tick()),
    sampleTimeNs: timeOf(from.sampleTimeNs(), "frames' sample time"),
    frames: decodeFrames(from.framesArray()!),
  };
}

function readError(from: fb.Error): m.ErrorMessage {
  const groom = from.groom();
  return {
    type: "error",
    reason: enumOf(from.reason(), 1, kErrorReasonLast, "error reason"),
    character: from.character(),
    groom: groom ? hashOf(groom) : null,
    detail: textOf(from.detail(kUtf8), "error detail"),
  };
}

function readGoodbye(from: fb.Goodbye): m.Goodbye {
  return {
    type: "goodbye",
    reason: enumOf(from.reason(), 1, kGoodbyeReasonLast, "goodbye reason"),
    detail: textOf(from.detail(kUtf8), "goodbye detail"),
  };
}

function readSetMaterial(from: fb.SetMaterial): m.SetMaterial {
  const s = from.scale()!;
  return {
    type: "setMaterial",
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
}

function readSetWind(from: fb.SetWind): m.SetWind {
  const w = from.wind()!;
  return {
    type: "setWind",
    wind: {
      meanMPerS: [w.meanX(), w.meanY(), w.meanZ()],
      gustRatio: w.gustRatio(),
      gustPeriodS: w.gustPeriodS(),
      turbulenceRmsMPerS: w.turbulenceRmsMPerS(),
      turbulenceScaleM: w.turbulenceScaleM(),
      seed: w.seed(),
    },
  };
}

function readObserve(from: fb.Observe): m.Observe {
  const origin = from.from();
  return {
    type: "observe",
    mode: enumOf(from.mode(), ObserveMode.all, ObserveMode.list, "observe mode"),
    count: from.count(),
    radiusM: from.radiusM(),
    from: origin ? vectorOf(origin) : null,
    members: membersOf(from.membersArray(), "observe"),
    errorClass: enumOf(from.errorClass(), ErrorClass.quarterMm, ErrorClass.oneMm, "error class"),
    stride: from.stride(),
    velocities: from.velocities(),
  };
}

function readReportImportance(from: fb.ReportImportance): m.ReportImportance {
  const count = from.membersLength();
  if (count > kMembersPerMessageMax) throw invalid(`importance: more than ${kMembersPerMessageMax} members`);
  const members: m.MemberImportance[] = [];
  for (let i = 0; i < count; ++i) {
    const each = from.members(i)!;
    const screenHeight = each.screenHeight();
    if (!(screenHeight >= 0 && screenHeight <= kScreenHeightMax))
      throw invalid(`importance: screen height not in [0, ${kScreenHeightMax}]`);
    members.push({ member: each.member(), screenHeight, inView: each.inView() });
  }
  return { type: "reportImportance", members };
}

function readRequestKeyframes(from: fb.RequestKeyframes): m.RequestKeyframes {
  return { type: "requestKeyframes", members: membersOf(from.membersArray(), "keyframes") };
}

function readGroomRequest(from: fb.GroomRequest): m.GroomRequest {
  return { type: "groomRequest", hash: hashOf(from.hash()), offset: Number(from.offset()) };
}

function readGroomData(from: fb.GroomData): m.GroomData {
  const bytes = from.bytesArray()!;
  const byteCount = Number(from.byteCount());
  const offset = Number(from.offset());
  const fits = byteCount <= kGroomBytesMax && offset + bytes.length <= byteCount && bytes.length <= kGroomChunkBytesMax;
  if (!fits) throw invalid("groom data: not within the groom");
  return { type: "groomData", hash: hashOf(from.hash()), byteCount, offset, bytes: bytes.slice() };
}

function readMemberJoined(from: fb.MemberJoined): m.MemberJoined {
  return {
    type: "memberJoined",
    member: from.member(),
    session: from.session(),
    character: from.character(),
    groom: hashOf(from.groom()),
  };
}
