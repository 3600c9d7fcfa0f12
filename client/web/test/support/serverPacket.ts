import * as flatbuffers from "flatbuffers";
import { writeAppearance, writeTag } from "../../src/net/appearanceCodec";
import * as fb from "../../src/net/generated/messages";
import type * as m from "../../src/net/messages";
import { fromHex } from "./vectors";

/** A server's packet, for the messages that tests need. */
export function serverPacket(clockNs: number, message: m.ServerMessage): Uint8Array {
  const to = new flatbuffers.Builder(256);
  const [type, body] = writeBody(to, message);
  fb.Envelope.startEnvelope(to);
  fb.Envelope.addClockNs(to, BigInt(clockNs));
  fb.Envelope.addBodyType(to, type);
  fb.Envelope.addBody(to, body);
  fb.Envelope.finishSizePrefixedEnvelopeBuffer(to, fb.Envelope.endEnvelope(to));
  return to.asUint8Array().slice();
}

function writeHash(to: flatbuffers.Builder, hash: string): flatbuffers.Offset {
  const view = new DataView(fromHex(hash).slice().buffer);
  return fb.Hash.createHash(
    to,
    view.getBigUint64(0, true),
    view.getBigUint64(8, true),
    view.getBigUint64(16, true),
    view.getBigUint64(24, true),
  );
}

function writeServer(to: flatbuffers.Builder, { host, port }: m.ServerAt): flatbuffers.Offset {
  return fb.ServerAt.createServerAt(to, to.createString(host), port);
}

function writeBody(to: flatbuffers.Builder, message: m.ServerMessage): [fb.Body, flatbuffers.Offset] {
  switch (message.type) {
    case "welcome": {
      const room = to.createString(message.room);
      const others = fb.Welcome.createOthersVector(
        to,
        message.others.map((other) => writeServer(to, other)),
      );
      fb.Welcome.startWelcome(to);
      fb.Welcome.addOthers(to, others);
      fb.Welcome.addProtocolVersion(to, message.protocolVersion);
      fb.Welcome.addSession(to, message.session);
      fb.Welcome.addTickRateHz(to, message.tickRateHz);
      fb.Welcome.addRoom(to, room);
      fb.Welcome.addResumed(to, message.resumed);
      fb.Welcome.addMaySetWind(to, message.maySetWind);
      fb.Welcome.addSignsOfLife(to, message.signsOfLife);
      fb.Welcome.addSecret(to, fb.Secret.createSecret(to, BigInt(message.secret[0]), 0n));
      return [fb.Body.Welcome, fb.Welcome.endWelcome(to)];
    }
    case "groomNeed":
      fb.GroomNeed.startGroomNeed(to);
      fb.GroomNeed.addHash(to, writeHash(to, message.hash));
      fb.GroomNeed.addOffset(to, BigInt(message.offset));
      return [fb.Body.GroomNeed, fb.GroomNeed.endGroomNeed(to)];
    case "groomStatus":
      fb.GroomStatus.startGroomStatus(to);
      fb.GroomStatus.addHash(to, writeHash(to, message.hash));
      fb.GroomStatus.addState(to, message.state);
      return [fb.Body.GroomStatus, fb.GroomStatus.endGroomStatus(to)];
    case "groomData": {
      const bytes = fb.GroomData.createBytesVector(to, message.bytes);
      fb.GroomData.startGroomData(to);
      fb.GroomData.addHash(to, writeHash(to, message.hash));
      fb.GroomData.addByteCount(to, BigInt(message.byteCount));
      fb.GroomData.addOffset(to, BigInt(message.offset));
      fb.GroomData.addBytes(to, bytes);
      return [fb.Body.GroomData, fb.GroomData.endGroomData(to)];
    }
    case "characterAdded":
      fb.CharacterAdded.startCharacterAdded(to);
      fb.CharacterAdded.addGroom(to, writeHash(to, message.groom));
      fb.CharacterAdded.addCharacter(to, message.character);
      fb.CharacterAdded.addLevel(to, message.level);
      fb.CharacterAdded.addMember(to, message.member);
      fb.CharacterAdded.addGeneration(to, message.generation ?? 0);
      return [fb.Body.CharacterAdded, fb.CharacterAdded.endCharacterAdded(to)];
    case "characterRemoved":
      return [fb.Body.CharacterRemoved, fb.CharacterRemoved.createCharacterRemoved(to, message.character)];
    case "memberJoined": {
      const tag = writeTag(to, message.tag);
      fb.MemberJoined.startMemberJoined(to);
      fb.MemberJoined.addGroom(to, writeHash(to, message.groom));
      fb.MemberJoined.addSession(to, message.session);
      fb.MemberJoined.addCharacter(to, message.character);
      fb.MemberJoined.addMember(to, message.member);
      fb.MemberJoined.addTag(to, tag);
      if (message.appearance) fb.MemberJoined.addAppearance(to, writeAppearance(to, message.appearance));
      fb.MemberJoined.addGeneration(to, message.generation ?? 0);
      return [fb.Body.MemberJoined, fb.MemberJoined.endMemberJoined(to)];
    }
    case "memberChanged": {
      const tag = writeTag(to, message.tag);
      fb.MemberChanged.startMemberChanged(to);
      fb.MemberChanged.addTag(to, tag);
      if (message.appearance) fb.MemberChanged.addAppearance(to, writeAppearance(to, message.appearance));
      fb.MemberChanged.addMember(to, message.member);
      return [fb.Body.MemberChanged, fb.MemberChanged.endMemberChanged(to)];
    }
    case "roomWind": {
      const [x, y, z] = message.wind.meanMPerS;
      const { gustRatio, gustPeriodS, turbulenceRmsMPerS, turbulenceScaleM, seed } = message.wind;
      fb.RoomWind.startRoomWind(to);
      fb.RoomWind.addWind(
        to,
        fb.Wind.createWind(to, x, y, z, gustRatio, gustPeriodS, turbulenceRmsMPerS, turbulenceScaleM, seed),
      );
      fb.RoomWind.addSession(to, message.session);
      return [fb.Body.RoomWind, fb.RoomWind.endRoomWind(to)];
    }
    case "memberLeft":
      return [fb.Body.MemberLeft, fb.MemberLeft.createMemberLeft(to, message.member)];
    case "groomBasis":
      fb.GroomBasis.startGroomBasis(to);
      fb.GroomBasis.addGroom(to, writeHash(to, message.groom));
      fb.GroomBasis.addBasis(to, writeHash(to, message.basis));
      return [fb.Body.GroomBasis, fb.GroomBasis.endGroomBasis(to)];
    case "groomLearnt":
      fb.GroomLearnt.startGroomLearnt(to);
      fb.GroomLearnt.addGroom(to, writeHash(to, message.groom));
      fb.GroomLearnt.addLearnt(to, writeHash(to, message.learnt));
      return [fb.Body.GroomLearnt, fb.GroomLearnt.endGroomLearnt(to)];
    case "frameBatch": {
      const frames = fb.FrameBatch.createFramesVector(to, packFrames(message.frames));
      const generations =
        message.generations.length > 0 ? fb.FrameBatch.createGenerationsVector(to, message.generations) : 0;
      fb.FrameBatch.startFrameBatch(to);
      fb.FrameBatch.addTick(to, BigInt(message.tick));
      fb.FrameBatch.addSampleTimeNs(to, BigInt(message.sampleTimeNs));
      fb.FrameBatch.addFrames(to, frames);
      if (generations !== 0) fb.FrameBatch.addGenerations(to, generations);
      return [fb.Body.FrameBatch, fb.FrameBatch.endFrameBatch(to)];
    }
    case "redirect": {
      const server = message.to ? writeServer(to, message.to) : 0;
      fb.Redirect.startRedirect(to);
      if (message.to) fb.Redirect.addTo(to, server);
      return [fb.Body.Redirect, fb.Redirect.endRedirect(to)];
    }
    case "error": {
      const detail = to.createString(message.detail);
      fb.Error.startError(to);
      if (message.groom) fb.Error.addGroom(to, writeHash(to, message.groom));
      fb.Error.addDetail(to, detail);
      fb.Error.addCharacter(to, message.character);
      fb.Error.addReason(to, message.reason);
      return [fb.Body.Error, fb.Error.endError(to)];
    }
    case "goodbye": {
      const detail = to.createString(message.detail);
      fb.Goodbye.startGoodbye(to);
      fb.Goodbye.addDetail(to, detail);
      fb.Goodbye.addReason(to, message.reason);
      return [fb.Body.Goodbye, fb.Goodbye.endGoodbye(to)];
    }
  }
}

function packFrames(frames: readonly m.CodedFrame[]): Uint8Array {
  const bytes: number[] = [];
  const varint = (value: number): void => {
    let rest = value;
    for (; rest >= 128; rest = Math.floor(rest / 128)) bytes.push((rest % 128) | 0x80);
    bytes.push(rest);
  };
  let member = 0;
  for (const f of frames) {
    varint(f.member - member);
    member = f.member;
    const logStride = Math.log2(f.stepStride);
    bytes.push(f.level | (f.discontinuous ? 8 : 0) | (f.asleep ? 16 : 0) | (logStride << 5) | (f.evaluated ? 128 : 0));
    varint(f.content.length);
    bytes.push(...f.content);
  }
  return Uint8Array.from(bytes);
}
