import { HairnetError } from "../hair/hairnetError";
import { ErrorClass, LevelIndex } from "../hair/level";
import { kPositionMaxM, validatePose } from "../hair/pose";
import { hashBytes } from "./groomHash";
import type { ClientMessage, HairState, Observe, PoseSample } from "./messages";
import {
  ObserveMode,
  Role,
  kGroomBytesMax,
  kGroomChunkBytesMax,
  kHairStateIntegersMax,
  kHairStateStepMaxM,
  kMembersPerMessageMax,
  kObserveRadiusMaxM,
  kPosesPerBatchMax,
  kScreenHeightMax,
  kTimeMaxNs,
  kTokenBytesMax,
  roomFault,
} from "./messages";

// What TypeScript's types do not hold callers to, and what a server would refuse.

/** Throws `HairnetError` unless the message can be sent as it is and a server may take it. */
export function validateMessage(message: ClientMessage): void {
  switch (message.type) {
    case "hello": {
      const fault = roomFault(message.room);
      if (fault) throw invalid(fault);
      if (new TextEncoder().encode(message.token).length > kTokenBytesMax)
        throw invalid(`token: longer than ${kTokenBytesMax} bytes`);
      checkInteger(message.role, Role.participant, Role.observer, "role");
      if (message.secret.length !== 16) throw invalid("secret: not 16 bytes");
      return;
    }
    case "groomOffer":
      hashBytes(message.hash);
      return checkInteger(message.byteCount, 1, kGroomBytesMax, "groom's bytes");
    case "groomChunk":
      hashBytes(message.hash);
      checkInteger(message.offset, 0, kGroomBytesMax, "chunk's offset");
      return checkInteger(message.bytes.length, 1, kGroomChunkBytesMax, "chunk's bytes");
    case "addCharacter":
      checkCharacter(message.character);
      hashBytes(message.groom);
      checkInteger(message.level, LevelIndex.high, LevelIndex.rigid, "level");
      return message.state ? checkState(message.state) : undefined;
    case "setLevel":
      checkCharacter(message.character);
      return checkInteger(message.level, LevelIndex.high, LevelIndex.rigid, "level");
    case "removeCharacter":
      return checkCharacter(message.character);
    case "poseBatch":
      checkInteger(message.poses.length, 0, kPosesPerBatchMax, "poses of a batch");
      return message.poses.forEach(validatePoseSample);
    case "setMaterial":
      checkCharacter(message.character);
      return checkNumbers(Object.values(message.scale), "material");
    case "setWind": {
      const { seed, meanMPerS, ...numbers } = message.wind;
      if (typeof seed !== "bigint") throw invalid("wind: the seed is no bigint");
      if (meanMPerS.length !== 3) throw invalid("wind: its mean is not 3 numbers");
      return checkNumbers([...meanMPerS, ...Object.values(numbers)], "wind");
    }
    case "observe":
      return checkObserve(message);
    case "reportImportance":
      checkInteger(message.members.length, 0, kMembersPerMessageMax, "members of a report");
      for (const each of message.members) {
        checkMember(each.member);
        if (!(each.screenHeight >= 0 && each.screenHeight <= kScreenHeightMax))
          throw invalid(`importance: screen height not in [0, ${kScreenHeightMax}]`);
      }
      return;
    case "requestKeyframes":
      checkInteger(message.members.length, 0, kMembersPerMessageMax, "members of a request");
      return message.members.forEach(checkMember);
    case "groomRequest":
      hashBytes(message.hash);
      return checkInteger(message.offset, 0, kGroomBytesMax, "request's offset");
    case "goodbye":
      return;
  }
}

/** Throws `HairnetError` unless a server may take it. */
export function validatePoseSample(sample: PoseSample): void {
  checkCharacter(sample.character);
  checkInteger(sample.sequence, 0, 0xffffffff, "pose's sequence");
  if (!(Math.abs(sample.captureTimeNs) <= kTimeMaxNs)) throw invalid("pose's capture time: out of range");
  validatePose(sample.pose);
}

function invalid(why: string): HairnetError {
  return new HairnetError("invalid", why);
}

function checkInteger(value: number, least: number, most: number, name: string): void {
  if (!Number.isInteger(value) || value < least || value > most)
    throw invalid(`${name}: ${value}, not a whole number in [${least}, ${most}]`);
}

const checkCharacter = (character: number) => checkInteger(character, 1, 0xffffffff, "character");
const checkMember = (member: number) => checkInteger(member, 0, 0xffffffff, "member");

function checkNumbers(values: readonly unknown[], name: string): void {
  if (!values.every(Number.isFinite)) throw invalid(`${name}: not finite numbers`);
}

function checkState(state: HairState): void {
  checkInteger(state.level, LevelIndex.high, LevelIndex.ether, "level of a hair state");
  const count = state.displacements.length;
  if (count === 0 || count % 3 !== 0 || count > kHairStateIntegersMax)
    throw invalid("hair state: not 3 integers a node, or too many");
  if (state.velocities.length !== 0 && state.velocities.length !== count) throw invalid("hair state: counts differ");
  if (!(state.stepM > 0 && state.stepM <= kHairStateStepMaxM)) throw invalid("hair state: step not in (0, 0.001] m");
}

function checkObserve(observe: Observe): void {
  checkInteger(observe.mode, ObserveMode.all, ObserveMode.list, "observe mode");
  checkInteger(observe.count, 0, 0xffffffff, "observed count");
  checkInteger(observe.errorClass, ErrorClass.quarterMm, ErrorClass.oneMm, "error class");
  checkInteger(observe.members.length, 0, kMembersPerMessageMax, "observed members");
  observe.members.forEach(checkMember);
  if (![1, 2, 4].includes(observe.stride)) throw invalid("observe: stride is not 1, 2 or 4");
  if (!(observe.radiusM >= 0 && observe.radiusM <= kObserveRadiusMaxM))
    throw invalid(`observe: radius not in [0, ${kObserveRadiusMaxM}] m`);
  const near = (x: number) => Math.abs(x) <= kPositionMaxM;
  if (observe.from && !(observe.from.length === 3 && observe.from.every(near)))
    throw invalid("observe: the point it is measured from is not finite or too far away");
}
