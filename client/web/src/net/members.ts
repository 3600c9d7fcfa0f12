import { dequantisePose } from "../hair/dequantise";
import type { LevelGeometry } from "../hair/lattice";
import { ErrorClass, LevelIndex, kStepsM } from "../hair/level";
import type { Pose } from "../hair/pose";
import { poseFault, rigidPose } from "../hair/pose";
import { isSameAppearance, type Appearance } from "../hair/appearance";
import { Bases, kBasisErrorClass } from "./bases";
import { decodeFrame } from "./codec/decodeFrame";
import { FrameIntegers, kHistoryMax } from "./codec/frameIntegers";
import type { GroomHash } from "./groomHash";
import type { HairSnapshot } from "./lastKnownHair";
import type { KnownLevel } from "./levelCatalog";
import { LevelCatalog, levelKey } from "./levelCatalog";
import type { CharacterAdded, CodedFrame, LevelRecord, MemberChanged, MemberJoined } from "./messages";

// Between two requests for a keyframe of one member: the answer takes a round trip.
const kKeyframeWaitNs = 500_000_000;
// Ring of the last decoded frames: as many as a frame may refer to, and one slot for the next frame.
const kSlotCount = kHistoryMax + 1;

class HistoryEntry {
  valid = false;
  tick = 0;
  level = LevelIndex.rigid;
  errorClass = ErrorClass.halfMm;
  geometry: LevelGeometry | null = null;
  readonly integers = new FrameIntegers();
}

class Member {
  confirmed = true;
  /** an undecodable frame was discontinuous */
  discontinuityPending = false;
  lastTick = -1;
  keyframeAskedNs = 0;
  keyframeAsked = false;
  newest = 0;
  readonly history = Array.from({ length: kSlotCount }, () => new HistoryEntry());
  readonly pose = rigidPose();
  /** looked up already, by level */
  readonly levels: (KnownLevel | undefined)[] = [undefined, undefined, undefined, undefined];

  constructor(
    /** the owner's; null: this one */
    readonly session: bigint | null,
    readonly character: number,
    readonly groom: GroomHash,
    public tag: Uint8Array = new Uint8Array(),
    public appearance: Appearance | null = null,
  ) {}

  get isOwn(): boolean {
    return this.session === null;
  }
}

/** What became of a frame. Reused by the next `decodeMemberFrame`. */
export interface DecodedFrame {
  /**
   * undecodable: what it refers to is missing, or its bytes are wrong; unknown: no such member, or no newer than the
   * last
   */
  outcome: "decoded" | "undecodable" | "unknown";
  wantsKeyframe: boolean;
  /** the file of a basis that the frame lacks */
  wantsBasis: GroomHash | null;
  /** the frame's own, or that of an undecodable one before it */
  discontinuous: boolean;
  /** this client's number; 0: another client's character */
  character: number;
  /** of a decoded frame; until the next frame of the member */
  integers: FrameIntegers | null;
  pose: Pose | null;
  /** of the geometry; the finest for frames of coefficients */
  level: LevelIndex;
  errorClass: ErrorClass;
  /** of a decoded frame's level; null: rigid */
  geometry: LevelGeometry | null;
}

/**
 * The members of the room as the server announced them, and the recent frames of each, from which the next are
 * decoded.
 */
export class Members {
  readonly bases = new Bases();
  readonly #members = new Map<number, Member>();
  readonly #catalog = new LevelCatalog();
  readonly #levels = new Map<string, KnownLevel>();
  readonly #history: FrameIntegers[] = [];
  readonly #decoded: DecodedFrame = {
    outcome: "unknown",
    wantsKeyframe: false,
    wantsBasis: null,
    discontinuous: false,
    character: 0,
    integers: null,
    pose: null,
    level: LevelIndex.rigid,
    errorClass: ErrorClass.halfMm,
    geometry: null,
  };

  /**
   * After a resume the server announces all members again. Those that are known already are the same, or their tag or
   * appearance has changed.
   */
  join(joined: MemberJoined): "new" | "same" | "changed" {
    const { session, character, groom, tag, appearance } = joined;
    if (this.#put(joined.member, new Member(session, character, groom, tag, appearance))) return "new";
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
    return this.#put(added.member, new Member(null, added.character, added.groom));
  }

  leave(member: number): boolean {
    return this.#members.delete(member);
  }

  /** If it is there. */
  removeOwn(character: number): void {
    const found = this.#findOwn(character);
    if (found) this.#members.delete(found[0]);
  }

  /** The geometry as it is known from now on. */
  addLevel(record: LevelRecord): LevelGeometry {
    const known = this.#catalog.keep(record);
    this.#levels.set(levelKey(record.groom, record.level), known);
    for (const member of this.#members.values()) {
      if (member.groom === record.groom) member.levels[record.level] = known;
    }
    return known.geometry;
  }

  decodeMemberFrame(frame: CodedFrame, tick: number, nowNs: number): DecodedFrame {
    const decoded = this.#decoded;
    decoded.outcome = "unknown";
    decoded.wantsKeyframe = decoded.discontinuous = false;
    decoded.wantsBasis = null;
    decoded.character = 0;
    decoded.integers = decoded.pose = decoded.geometry = null;
    const member = this.#members.get(frame.member);
    if (!member || tick <= member.lastTick) return decoded;
    member.lastTick = tick;
    decoded.character = member.isOwn ? member.character : 0;
    decoded.discontinuous = frame.discontinuous || member.discontinuityPending;
    if (frame.coefficients) decoded.wantsBasis = this.bases.wanted(member.groom, nowNs);
    if (this.#decode(member, frame, tick, decoded)) {
      decoded.outcome = "decoded";
      member.discontinuityPending = member.keyframeAsked = false;
      return decoded;
    }
    decoded.outcome = "undecodable";
    member.discontinuityPending = decoded.discontinuous;
    decoded.wantsKeyframe = !member.keyframeAsked || nowNs - member.keyframeAskedNs >= kKeyframeWaitNs;
    if (decoded.wantsKeyframe) member.keyframeAskedNs = nowNs;
    member.keyframeAsked = true;
    return decoded;
  }

  /** The last hair of an own character, copied; null when it has none. */
  hairOf(character: number): HairSnapshot | null {
    const found = this.#findOwn(character);
    if (!found) return null;
    const member = found[1];
    const last = member.history[member.newest];
    if (!last.valid || last.integers.nodes.length === 0 || !last.geometry) return null;
    return {
      groom: member.groom,
      errorClass: last.errorClass,
      state: {
        level: last.level,
        stepM: kStepsM[last.errorClass],
        displacements: last.integers.nodes.slice(),
        velocities: last.integers.velocities.slice(),
      },
      geometry: last.geometry,
    };
  }

  forgetFrames(): void {
    for (const member of this.#members.values()) {
      for (const past of member.history) past.valid = false;
      member.keyframeAsked = false;
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
    this.#levels.clear();
    return this.dropUnconfirmed();
  }

  #put(number: number, member: Member): boolean {
    const known = this.#members.get(number);
    const same =
      known !== undefined &&
      known.session === member.session &&
      known.character === member.character &&
      known.groom === member.groom;
    if (same) known.confirmed = true;
    else this.#members.set(number, member);
    return !same;
  }

  #findOwn(character: number): [number, Member] | null {
    for (const entry of this.#members) {
      if (entry[1].isOwn && entry[1].character === character) return entry;
    }
    return null;
  }

  #decode(member: Member, frame: CodedFrame, tick: number, decoded: DecodedFrame): boolean {
    const slot = (member.newest + 1) % kSlotCount;
    const next = member.history[slot];
    next.valid = false;
    const isDecoded = frame.coefficients
      ? this.#decodeCoefficients(member, frame, next)
      : this.#decodeNodes(member, frame, tick, next);
    if (!isDecoded || poseFault(member.pose)) return false;
    next.valid = true;
    next.tick = tick;
    member.newest = slot;
    decoded.integers = next.integers;
    decoded.pose = member.pose;
    decoded.level = next.level;
    decoded.errorClass = next.errorClass;
    decoded.geometry = next.geometry;
    return true;
  }

  #decodeCoefficients(member: Member, frame: CodedFrame, entry: HistoryEntry): boolean {
    const isRigid = frame.level === LevelIndex.rigid;
    const geometry = this.bases.decode(member.groom, frame.content, isRigid, entry.integers, member.pose);
    if (geometry === undefined) return false;
    entry.level = geometry ? LevelIndex.high : LevelIndex.rigid;
    entry.errorClass = kBasisErrorClass;
    entry.geometry = geometry;
    return true;
  }

  #decodeNodes(member: Member, frame: CodedFrame, tick: number, entry: HistoryEntry): boolean {
    const level = frame.level === LevelIndex.rigid ? null : this.#levelOf(member, frame.level);
    if (level === undefined) return false;
    const numbers = level ? 3 * level.geometry.activeNodes.length : 0;
    const history = this.#history;
    history.length = 0;
    for (let k = 0; k < frame.order; ++k) {
      const past = member.history[(member.newest + kSlotCount - k) % kSlotCount];
      const expected = tick - (k + 1) * frame.stride;
      if (!past.valid || past.tick !== expected || past.integers.nodes.length !== numbers) return false;
      history.push(past.integers);
    }
    const { integers } = entry;
    if (!decodeFrame(frame.content, history, frame.order, level?.neighbours ?? null, frame.velocities, integers))
      return false;
    dequantisePose(integers.bones, member.pose);
    entry.level = frame.level;
    entry.errorClass = frame.errorClass;
    entry.geometry = level?.geometry ?? null;
    return true;
  }

  #levelOf(member: Member, level: LevelIndex): KnownLevel | undefined {
    member.levels[level] ??= this.#levels.get(levelKey(member.groom, level));
    return member.levels[level];
  }
}
