import * as flatbuffers from "flatbuffers";
import { HairnetError } from "../hair/hairnetError";
import * as fb from "./generated/messages";
import { hashBytes } from "./groomHash";
import type * as m from "./messages";
import { kPacketBytesMax, kTimeMaxNs } from "./messages";
import { fitText } from "./text";
import { validateMessage } from "./validateMessage";

type Builder = flatbuffers.Builder;
type Offset = flatbuffers.Offset;

/**
 * One size-prefixed packet, ready to send. Text is made fit to travel (`fitText`). Throws `HairnetError` for what may not
 * be sent.
 */
export function encodePacket(clockNs: number, message: m.ClientMessage): Uint8Array {
  validateMessage(message);
  if (!(Math.abs(clockNs) <= kTimeMaxNs)) throw new HairnetError("invalid", "clock out of range");
  const to = new flatbuffers.Builder(1024);
  const [type, body] = writeBody(to, message);
  fb.Envelope.startEnvelope(to);
  fb.Envelope.addClockNs(to, wholeNs(clockNs));
  fb.Envelope.addBody(to, body);
  fb.Envelope.addBodyType(to, type);
  fb.Envelope.finishSizePrefixedEnvelopeBuffer(to, fb.Envelope.endEnvelope(to));
  const packet = to.asUint8Array();
  if (packet.length > kPacketBytesMax)
    throw new HairnetError("too_large", `packet of ${packet.length} bytes, more than ${kPacketBytesMax}`);
  return packet;
}

const wholeNs = (ns: number): bigint => BigInt(Math.round(ns));

function writeBody(to: Builder, message: m.ClientMessage): [fb.Body, Offset] {
  switch (message.type) {
    case "hello":
      return [fb.Body.Hello, writeHello(to, message)];
    case "groomOffer":
      fb.GroomOffer.startGroomOffer(to);
      fb.GroomOffer.addHash(to, writeHash(to, message.hash));
      fb.GroomOffer.addByteCount(to, BigInt(message.byteCount));
      return [fb.Body.GroomOffer, fb.GroomOffer.endGroomOffer(to)];
    case "groomChunk": {
      const bytes = to.createByteVector(message.bytes);
      fb.GroomChunk.startGroomChunk(to);
      fb.GroomChunk.addHash(to, writeHash(to, message.hash));
      fb.GroomChunk.addOffset(to, BigInt(message.offset));
      fb.GroomChunk.addBytes(to, bytes);
      return [fb.Body.GroomChunk, fb.GroomChunk.endGroomChunk(to)];
    }
    case "addCharacter":
      return [fb.Body.AddCharacter, writeAddCharacter(to, message)];
    case "setLevel":
      fb.SetLevel.startSetLevel(to);
      fb.SetLevel.addCharacter(to, message.character);
      fb.SetLevel.addLevel(to, message.level);
      return [fb.Body.SetLevel, fb.SetLevel.endSetLevel(to)];
    case "removeCharacter":
      fb.RemoveCharacter.startRemoveCharacter(to);
      fb.RemoveCharacter.addCharacter(to, message.character);
      return [fb.Body.RemoveCharacter, fb.RemoveCharacter.endRemoveCharacter(to)];
    case "poseBatch":
      return [fb.Body.PoseBatch, writePoseBatch(to, message)];
    case "setMaterial": {
      const s = message.scale;
      fb.SetMaterial.startSetMaterial(to);
      fb.SetMaterial.addScale(
        to,
        fb.MaterialScale.createMaterialScale(
          to, s.stiffness, s.damping, s.density, s.etherDamping, s.airDrag, s.gelPerS2,
        ),
      );
      fb.SetMaterial.addCharacter(to, message.character);
      return [fb.Body.SetMaterial, fb.SetMaterial.endSetMaterial(to)];
    }
    case "setWind": {
      const w = message.wind;
      const [x, y, z] = w.meanMPerS;
      fb.SetWind.startSetWind(to);
      fb.SetWind.addWind(
        to,
        fb.Wind.createWind(
          to, x, y, z, w.gustRatio, w.gustPeriodS, w.turbulenceRmsMPerS, w.turbulenceScaleM, BigInt.asUintN(64, w.seed),
        ),
      );
      return [fb.Body.SetWind, fb.SetWind.endSetWind(to)];
    }
    case "observe":
      return [fb.Body.Observe, writeObserve(to, message)];
    case "reportImportance":
      return [fb.Body.ReportImportance, writeReportImportance(to, message)];
    case "requestKeyframes": {
      const members = fb.RequestKeyframes.createMembersVector(to, message.members as number[]);
      return [fb.Body.RequestKeyframes, fb.RequestKeyframes.createRequestKeyframes(to, members)];
    }
    case "groomRequest":
      fb.GroomRequest.startGroomRequest(to);
      fb.GroomRequest.addHash(to, writeHash(to, message.hash));
      fb.GroomRequest.addOffset(to, BigInt(message.offset));
      return [fb.Body.GroomRequest, fb.GroomRequest.endGroomRequest(to)];
    case "goodbye": {
      const detail = to.createString(fitText(message.detail));
      fb.Goodbye.startGoodbye(to);
      fb.Goodbye.addDetail(to, detail);
      fb.Goodbye.addReason(to, message.reason);
      return [fb.Body.Goodbye, fb.Goodbye.endGoodbye(to)];
    }
  }
}

function words(bytes: Uint8Array): bigint[] {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  return Array.from({ length: bytes.length / 8 }, (_, i) => view.getBigUint64(8 * i, true));
}

function writeHash(to: Builder, hash: string): Offset {
  const [a, b, c, d] = words(hashBytes(hash));
  return fb.Hash.createHash(to, a, b, c, d);
}

function writeHello(to: Builder, hello: m.Hello): Offset {
  const name = to.createString(fitText(hello.clientName));
  const room = to.createString(hello.room);
  const token = to.createString(hello.token);
  fb.Hello.startHello(to);
  fb.Hello.addProtocolVersion(to, hello.protocolVersion);
  fb.Hello.addClientName(to, name);
  fb.Hello.addRoom(to, room);
  fb.Hello.addToken(to, token);
  fb.Hello.addRole(to, hello.role);
  if (hello.session !== 0n) {
    const [a, b] = words(hello.secret);
    fb.Hello.addSession(to, hello.session);
    fb.Hello.addSecret(to, fb.Secret.createSecret(to, a, b));
  }
  return fb.Hello.endHello(to);
}

function writeAddCharacter(to: Builder, added: m.AddCharacter): Offset {
  const state = added.state ? writeHairState(to, added.state) : 0;
  fb.AddCharacter.startAddCharacter(to);
  fb.AddCharacter.addGroom(to, writeHash(to, added.groom));
  fb.AddCharacter.addCharacter(to, added.character);
  fb.AddCharacter.addLevel(to, added.level);
  if (state !== 0) fb.AddCharacter.addState(to, state);
  return fb.AddCharacter.endAddCharacter(to);
}

function writeHairState(to: Builder, state: m.HairState): Offset {
  const displacements = writeShorts(to, state.displacements);
  const velocities = writeShorts(to, state.velocities);
  fb.HairState.startHairState(to);
  fb.HairState.addDisplacements(to, displacements);
  fb.HairState.addVelocities(to, velocities);
  fb.HairState.addStepM(to, state.stepM);
  fb.HairState.addLevel(to, state.level);
  return fb.HairState.endHairState(to);
}

function writeShorts(to: Builder, integers: Int16Array): Offset {
  to.startVector(2, integers.length, 2);
  for (let i = integers.length - 1; i >= 0; --i) to.addInt16(integers[i]);
  return to.endVector();
}

function writePoseBatch(to: Builder, batch: m.PoseBatch): Offset {
  fb.PoseBatch.startPosesVector(to, batch.poses.length);
  for (let i = batch.poses.length - 1; i >= 0; --i) writePose(to, batch.poses[i]);
  return fb.PoseBatch.createPoseBatch(to, to.endVector());
}

/** A struct PoseSample, from its end as builders write; the 35 numbers of a `Pose` lie in its order. */
function writePose(to: Builder, sample: m.PoseSample): void {
  to.prep(8, fb.PoseSample.sizeOf());
  to.pad(3);
  to.writeInt8(sample.teleport ? 1 : 0);
  for (let i = sample.pose.length - 1; i >= 0; --i) to.writeFloat32(sample.pose[i]);
  to.writeInt32(sample.sequence);
  to.writeInt32(sample.character);
  to.writeInt64(wholeNs(sample.captureTimeNs));
}

function writeObserve(to: Builder, observe: m.Observe): Offset {
  const members = fb.Observe.createMembersVector(to, observe.members as number[]);
  fb.Observe.startObserve(to);
  fb.Observe.addMembers(to, members);
  if (observe.from) fb.Observe.addFrom(to, fb.Vec3.createVec3(to, ...observe.from));
  fb.Observe.addCount(to, observe.count);
  fb.Observe.addRadiusM(to, observe.radiusM);
  fb.Observe.addStride(to, observe.stride);
  fb.Observe.addMode(to, observe.mode);
  fb.Observe.addErrorClass(to, observe.errorClass);
  fb.Observe.addVelocities(to, observe.velocities);
  return fb.Observe.endObserve(to);
}

function writeReportImportance(to: Builder, report: m.ReportImportance): Offset {
  fb.ReportImportance.startMembersVector(to, report.members.length);
  for (let i = report.members.length - 1; i >= 0; --i) {
    const each = report.members[i];
    fb.MemberImportance.createMemberImportance(to, each.member, each.screenHeight, each.inView);
  }
  return fb.ReportImportance.createReportImportance(to, to.endVector());
}
