import { isSameAppearance, type Appearance } from "../hair/appearance";
import { LevelIndex } from "../hair/level";
import { poseFault, type Pose } from "../hair/pose";
import { newBases, type KnownBasis } from "./bases";
import { decodeFrame } from "./codec/frame";
import { GroomFiles } from "./groomFiles";
import type { GroomHash } from "./groomHash";
import { hairStateOf, type HairMoment } from "./hairState";
import type { HairSnapshot } from "./lastKnownHair";
import { decodeLearnt } from "./learntFile";
import { kLearntSettledTicks } from "../generated/constants";
import { LearntTrack } from "./learntTrack";
import type { CharacterAdded, CodedFrame, EvaluateLearnt, GroomLearnt, MemberChanged, MemberJoined } from "./messages";

class Member {
  confirmed = true;
  /** an undecodable frame was discontinuous */
  discontinuityPending = false;
  lastTick = -1;
  /** of the last frame and the one before; null: no hair */
  newest: HairMoment | null = null;
  before: HairMoment | null = null;
  /** pose of the last frame, and its tick; null: there is none */
  lastPose: { readonly pose: Pose; readonly tick: number } | null = null;
  learnt = new LearntTrack();
  /** The frame of a sleeping character comes once. It waits here if the groom's basis had not arrived. */
  waiting: WaitingFrame | null = null;

  constructor(
    /** the owner's; null: this one */
    readonly session: bigint | null,
    readonly character: number,
    readonly groom: GroomHash,
    public tag: Uint8Array = new Uint8Array(),
    public appearance: Appearance | null = null,
    /** counts the characters that have had this number, modulo 256 */
    public generation = 0,
  ) {}

  get isOwn(): boolean {
    return this.session === null;
  }
}

/** `DecodedFrame`, while `Members` fills it in. */
interface FrameInProgress {
  /**
   * undecodable: its bytes are wrong; unknown: no such member, of an earlier or later one of its number, or not newer
   * than the last frame
   */
  outcome: "decoded" | "undecodable" | "unknown";
  /** the file of a basis that the frame lacks */
  wantsBasis: GroomHash | null;
  /** the file of the learnt hair that the frame shows, if it is not here */
  wantsLearnt: GroomHash | null;
  /** to tell the server: what the hair depends on is here; or again, since the network has missed too many frames */
  evaluates: EvaluateLearnt | null;
  /** it has no coefficients, and the learnt hair is not here */
  lacksLearnt: boolean;
  /** the frame's own mark, or that of an earlier undecodable frame */
  discontinuous: boolean;
  /** this client's number; 0: another client's character */
  character: number;
  /** of a decoded frame */
  pose: Pose | null;
  coefficients: Float32Array;
  /** null: the hair is at rest, or its basis has not arrived yet */
  basis: KnownBasis | null;
}
/** What became of a frame. */
export type DecodedFrame = Readonly<FrameInProgress>;

/** The last frame of a character, decoded without its groom's basis. */
interface WaitingFrame {
  readonly coded: CodedFrame;
  readonly tick: number;
  readonly timeNs: number;
  readonly decoded: DecodedFrame;
}

const kNone = new Float32Array(0);
const kUnknown: DecodedFrame = {
  outcome: "unknown",
  wantsBasis: null,
  wantsLearnt: null,
  evaluates: null,
  lacksLearnt: false,
  discontinuous: false,
  character: 0,
  pose: null,
  coefficients: kNone,
  basis: null,
};

/** The members of the room, as the server announced them, and the last frames of each. */
export class Members {
  readonly bases = newBases();
  readonly learnt = new GroomFiles(decodeLearnt);
  /** whether the groom's hair is of use now: its basis and learnt hair are asked for then */
  isOfUse: (groom: GroomHash) => boolean = () => true;
  /**
   * Grooms whose hair the server knows this client to evaluate, and the tick of the frame at which it was told so again;
   * null: frames have had coefficients since.
   */
  readonly #learntTold = new Map<GroomHash, number | null>();
  readonly #members = new Map<number, Member>();

  /** The server announces the hair again over each connection, and is told again that this client evaluates it. */
  announceLearnt({ groom, learnt }: GroomLearnt): void {
    this.learnt.announce(groom, learnt);
    this.#learntTold.delete(groom);
  }

  /**
   * After a resume the server announces all members again. Those that are known already are the same, or their tag or
   * appearance has changed.
   */
  join(joined: MemberJoined): "new" | "same" | "changed" {
    const { session, character, groom, tag, appearance, generation } = joined;
    if (this.#put(joined.member, new Member(session, character, groom, tag, appearance, generation))) return "new";
    return this.change(joined) ? "changed" : "same";
  }

  /** False when there is no such member, or it has both already. */
  change({ member, tag, appearance }: Pick<MemberChanged, "member" | "tag" | "appearance">): boolean {
    const known = this.#members.get(member);
    if (!known) return false;
    const isSameTag = known.tag.length === tag.length && tag.every((byte, i) => byte === known.tag[i]);
    if (isSameTag && isSameAppearance(known.appearance, appearance)) return false;
    known.tag = tag;
    known.appearance = appearance;
    return true;
  }

  addOwn(added: CharacterAdded): boolean {
    const { character, groom, generation } = added;
    return this.#put(added.member, new Member(null, character, groom, undefined, null, generation));
  }

  leave(member: number): boolean {
    return this.#members.delete(member);
  }

  /** If it is there. */
  removeOwn(character: number): void {
    const found = this.#findOwn(character);
    if (found) this.#members.delete(found[0]);
  }

  /**
   * After a frame that cannot be decoded, the character still has the one before. `generation`: of the member that the
   * frame is of; null: its packet has not overtaken others.
   */
  decodeMemberFrame(
    frame: CodedFrame,
    generation: number | null,
    tick: number,
    timeNs: number,
    nowNs: number,
  ): DecodedFrame {
    const member = this.#members.get(frame.member);
    if (!member || (generation !== null && generation !== member.generation)) return kUnknown;
    if (tick <= member.lastTick) {
      // A newer frame has overtaken it: the next one is discontinuous in its place.
      member.discontinuityPending ||= frame.discontinuous && tick < member.lastTick;
      return kUnknown;
    }
    member.lastTick = tick;
    const isRigid = frame.level === LevelIndex.rigid;
    const known = this.bases.of(member.groom);
    const before = member.newest;
    const decoded: FrameInProgress = {
      ...kUnknown,
      wantsBasis: isRigid ? null : this.#wanted(this.bases, member.groom, nowNs),
      discontinuous: frame.discontinuous || member.discontinuityPending,
      character: member.isOwn ? member.character : 0,
    };
    const isDecoded = decode(member, frame, timeNs, known, decoded);
    member.discontinuityPending = !isDecoded && decoded.discontinuous;
    if (!isDecoded) return decoded;
    this.#followLearnt(member, before, frame, tick, nowNs, decoded);
    member.lastPose = { pose: decoded.pose!, tick };
    member.waiting =
      frame.asleep && !isRigid && !known
        ? { coded: { ...frame, content: frame.content.slice() }, tick, timeNs, decoded }
        : null;
    return decoded;
  }

  /** The coefficients of the frame become those to show. `before`: the hair of the frame before. */
  #followLearnt(
    member: Member,
    before: HairMoment | null,
    frame: CodedFrame,
    tick: number,
    nowNs: number,
    decoded: FrameInProgress,
  ): void {
    const { groom, newest, lastPose } = member;
    if (!newest) {
      member.learnt = new LearntTrack();
      return;
    }
    if (before && before.basis !== newest.basis) member.learnt = new LearntTrack();
    const isLearnt = frame.level === LevelIndex.learnt;
    if (!isLearnt && member.learnt.isIdle) return;
    const hair = this.learnt.of(groom);
    if (isLearnt) decoded.wantsLearnt = this.#wanted(this.learnt, groom, nowNs);
    const shownBefore = before?.basis === newest.basis ? before.coefficients : null;
    if (!hair && frame.evaluated) {
      member.learnt = new LearntTrack();
      decoded.lacksLearnt = true;
      if (shownBefore) newest.coefficients.set(shownBefore);
      return;
    }
    const isFirst = hair !== null && isLearnt && !this.#learntTold.has(groom);
    if (isFirst || (hair && isLearnt && !frame.evaluated)) this.#learntTold.set(groom, null);
    const motion = {
      from: lastPose?.pose ?? null,
      to: newest.pose,
      ticks: lastPose ? tick - lastPose.tick : 0,
      isLearnt,
      evaluated: frame.evaluated,
      discontinuous: decoded.discontinuous,
    };
    member.learnt.show(hair, motion, shownBefore, newest.coefficients);
    const isGap = frame.evaluated && member.learnt.isUnsettled && this.#tellsOfGap(groom, tick);
    if (isFirst || isGap) decoded.evaluates = { type: "evaluateLearnt", groom, learnt: this.learnt.fileOf(groom)! };
  }

  /** Once, until the answer has come. */
  #tellsOfGap(groom: GroomHash, tick: number): boolean {
    const told = this.#learntTold.get(groom) ?? null;
    if (told !== null && tick - told < kLearntSettledTicks) return false;
    this.#learntTold.set(groom, tick);
    return true;
  }

  /** Decodes the frames that waited for the basis of this groom and are still the newest. */
  decodeWaiting(groom: GroomHash): WaitingFrame[] {
    const ready: WaitingFrame[] = [];
    const known = this.bases.of(groom);
    for (const member of this.#members.values()) {
      const { waiting } = member;
      if (!waiting || member.groom !== groom || !known) continue;
      member.waiting = null;
      const decoded = { ...waiting.decoded };
      decode(member, waiting.coded, waiting.timeNs, known, decoded);
      ready.push({ ...waiting, decoded });
    }
    return ready;
  }

  /** The files of bases that such frames still lack and that are to be asked for again. */
  wantedAgain(nowNs: number): GroomHash[] {
    const waiting = [...this.#members.values()].filter((member) => member.waiting);
    return waiting.map((member) => this.#wanted(this.bases, member.groom, nowNs)).filter((file) => file !== null);
  }

  #wanted<Known extends object>(files: GroomFiles<Known>, groom: GroomHash, nowNs: number): GroomHash | null {
    return this.isOfUse(groom) ? files.wanted(groom, nowNs) : null;
  }

  /** The hair of an own character's last decoded frame; null unless it had coefficients of the groom's newest basis. */
  hairOf(character: number): HairSnapshot | null {
    const member = this.#findOwn(character)?.[1];
    const newest = member?.newest;
    if (!newest || newest.basis !== this.bases.of(member.groom)) return null;
    const { basis, coefficients } = newest;
    return { groom: member.groom, basis, coefficients, state: hairStateOf(newest, member.before) };
  }

  /** The connection broke: the next frame may be of another server, and comes later. */
  forgetFrames(): void {
    for (const member of this.#members.values()) {
      member.newest = member.before = member.waiting = member.lastPose = null;
      member.learnt = new LearntTrack();
    }
  }

  /**
   * After a resume the server announces all members again. `dropUnconfirmed` then removes those that it did not
   * announce.
   */
  markAllUnconfirmed(): void {
    for (const member of this.#members.values()) member.confirmed = false;
  }

  /**
   * Removes and returns the old member number of the same character, which left and came back during the outage; null
   * if there is none.
   */
  dropPreviousNumber(session: bigint, character: number, number: number): number | null {
    for (const [other, member] of this.#members) {
      if (member.confirmed || other === number || member.session !== session || member.character !== character)
        continue;
      this.#members.delete(other);
      return other;
    }
    return null;
  }

  /** Returns the others among them. */
  dropUnconfirmed(): number[] {
    const left: number[] = [];
    for (const [number, member] of this.#members) {
      if (member.confirmed) continue;
      if (!member.isOwn) left.push(number);
      this.#members.delete(number);
    }
    return left;
  }

  /** The session is lost. Returns all others. */
  dropAll(): number[] {
    this.markAllUnconfirmed();
    return this.dropUnconfirmed();
  }

  #put(number: number, member: Member): boolean {
    const known = this.#members.get(number);
    const same =
      known !== undefined &&
      known.session === member.session &&
      known.character === member.character &&
      known.groom === member.groom;
    if (same) {
      known.confirmed = true;
      known.generation = member.generation;
    } else this.#members.set(number, member);
    return !same;
  }

  #findOwn(character: number): [number, Member] | null {
    for (const entry of this.#members) {
      if (entry[1].isOwn && entry[1].character === character) return entry;
    }
    return null;
  }
}

/** False for bytes that are no frame. */
function decode(
  member: Member,
  frame: CodedFrame,
  timeNs: number,
  known: KnownBasis | null,
  decoded: FrameInProgress,
): boolean {
  const content = decodeFrame(frame.content, known?.code ?? null);
  const isDecoded = content !== null && !poseFault(content.pose);
  decoded.outcome = isDecoded ? "decoded" : "undecodable";
  decoded.pose = isDecoded ? content.pose : null;
  decoded.basis = isDecoded && frame.level !== LevelIndex.rigid ? known : null;
  decoded.coefficients = decoded.basis ? content!.coefficients : kNone;
  if (!isDecoded) return false;
  const { pose } = content;
  const { basis, coefficients } = decoded;
  member.before = decoded.discontinuous ? null : member.newest;
  member.newest = basis ? { timeNs, pose, basis, coefficients } : null;
  return true;
}
