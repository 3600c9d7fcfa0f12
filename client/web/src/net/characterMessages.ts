import type { Appearance } from "../hair/appearance";
import { checkAppearance } from "../hair/appearance";
import type { LevelIndex } from "../hair/level";
import { kPoseNumbers, validatePose, type Pose } from "../hair/pose";
import { appearanceOf, checkTag, tagOf, writeAppearance, writeTag } from "./appearanceCodec";
import * as fb from "./generated/messages";
import { readEarlier, writeEarlier, type EarlierPose } from "./earlierPose";
import { hashBytes, type GroomHash } from "./groomHash";
import { checkState, readState, writeState, type HairState } from "./hairState";
import { kEarlierPosesMax, kPosesPerBatchMax, kTimeMaxNs } from "../generated/limits";
import {
  checkCharacter,
  checkInteger,
  checkLevel,
  checkNumbers,
  hashOf,
  invalid,
  levelOf,
  timeOf,
  wholeNs,
  writeHash,
  type Builder,
  type ClientCodec,
} from "./messageCodec";

// What a client says about its own characters.

export type { HairState };

export interface AddCharacter {
  readonly type: "addCharacter";
  /** the client's own number, not 0 */
  readonly character: number;
  readonly groom: GroomHash;
  /** the finest that it is given */
  readonly level: LevelIndex;
  /** what it goes on from; null: its design */
  readonly state: HairState | null;
  /** any bytes, at most 256; for applications */
  readonly tag: Uint8Array;
  /** null: the receiver's default */
  readonly appearance: Appearance | null;
}
const addCharacter: ClientCodec<AddCharacter> = {
  write(to, message) {
    const state = message.state ? writeState(to, message.state) : 0;
    const tag = writeTag(to, message.tag);
    fb.AddCharacter.startAddCharacter(to);
    fb.AddCharacter.addGroom(to, writeHash(to, message.groom));
    fb.AddCharacter.addCharacter(to, message.character);
    fb.AddCharacter.addLevel(to, message.level);
    if (state !== 0) fb.AddCharacter.addState(to, state);
    fb.AddCharacter.addTag(to, tag);
    if (message.appearance) fb.AddCharacter.addAppearance(to, writeAppearance(to, message.appearance));
    return fb.AddCharacter.endAddCharacter(to);
  },
  read(from) {
    const groom = hashOf(from.groom());
    const level = levelOf(from.level());
    const state = from.state();
    const tag = tagOf(from.tagArray());
    const appearance = appearanceOf(from.appearance());
    return { character: from.character(), groom, level, state: state && readState(state), tag, appearance };
  },
  check({ character, groom, level, state, tag, appearance }) {
    checkCharacter(character);
    hashBytes(groom);
    checkLevel(level);
    if (state) checkState(state);
    checkTag(tag);
    if (appearance) checkAppearance(appearance);
  },
};

/** Replaces tag and appearance of `AddCharacter`. */
export interface SetAppearance {
  readonly type: "setAppearance";
  readonly character: number;
  readonly tag: Uint8Array;
  readonly appearance: Appearance | null;
}
const setAppearance: ClientCodec<SetAppearance> = {
  resent: "character",
  write(to, { character, tag, appearance }) {
    const tagAt = writeTag(to, tag);
    fb.SetAppearance.startSetAppearance(to);
    fb.SetAppearance.addTag(to, tagAt);
    if (appearance) fb.SetAppearance.addAppearance(to, writeAppearance(to, appearance));
    fb.SetAppearance.addCharacter(to, character);
    return fb.SetAppearance.endSetAppearance(to);
  },
  read: (from) => ({
    character: from.character(),
    tag: tagOf(from.tagArray()),
    appearance: appearanceOf(from.appearance()),
  }),
  check({ character, tag, appearance }) {
    checkCharacter(character);
    checkTag(tag);
    if (appearance) checkAppearance(appearance);
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
  /** since datagrams get lost, each character's in order; absent: none */
  readonly earlier?: readonly EarlierPose[];
}

function checkEarlier(earlier: readonly EarlierPose[], poses: readonly PoseSample[]): void {
  for (const { character, sequenceBefore } of earlier) {
    if (!poses.some((pose) => pose.character === character))
      throw invalid(`pose batch: an earlier pose of character ${character}, which has no pose`);
    if (sequenceBefore === 0) throw invalid("pose batch: an earlier pose with the sequence of the pose");
  }
}

const poseBatch: ClientCodec<PoseBatch> = {
  write(to, { poses, earlier = [] }) {
    fb.PoseBatch.startPosesVector(to, poses.length);
    for (let i = poses.length - 1; i >= 0; --i) writePose(to, poses[i]);
    const posesAt = to.endVector();
    if (earlier.length === 0) return fb.PoseBatch.createPoseBatch(to, posesAt, 0);
    fb.PoseBatch.startEarlierVector(to, earlier.length);
    for (let i = earlier.length - 1; i >= 0; --i) writeEarlier(to, earlier[i]);
    return fb.PoseBatch.createPoseBatch(to, posesAt, to.endVector());
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
    const earlierCount = from.earlierLength();
    if (earlierCount === 0) return { poses };
    if (earlierCount > kEarlierPosesMax)
      throw invalid(`pose batch: ${earlierCount} earlier poses, more than ${kEarlierPosesMax}`);
    const earlier = Array.from({ length: earlierCount }, (_, i) => readEarlier(from.earlier(i)!));
    checkEarlier(earlier, poses);
    return { poses, earlier };
  },
  check({ poses, earlier = [] }) {
    checkInteger(poses.length, 0, kPosesPerBatchMax, "poses of a batch");
    checkInteger(earlier.length, 0, kEarlierPosesMax, "earlier poses of a batch");
    poses.forEach(validatePoseSample);
    checkEarlier(earlier, poses);
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

/** @internal */
export const characterCodecs = { addCharacter, setLevel, removeCharacter, poseBatch, setMaterial, setAppearance };
