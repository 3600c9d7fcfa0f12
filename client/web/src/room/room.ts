import { checkOptions } from "../hair/checkOptions";
import { DroppedInput, notFinite } from "../hair/droppedInput";
import type { Groom } from "../hair/groom";
import { HairnetError } from "../hair/hairnetError";
import { LevelIndex } from "../hair/level";
import { checkLinkOptions, kLinkOptions, Link, type LinkOptions } from "../net/link";
import { validateMessage } from "../net/clientMessages";
import type { LinkEvent } from "../net/events";
import { decodeGroom } from "../net/groomFile";
import { isFinal } from "../net/finalGoodbye";
import type { Downloads } from "../net/groomFetch";
import { hashGroom } from "../net/groomHash";
import type { LinkCounters } from "../net/linkCoreOptions";
import { ErrorReason, GroomState, type ModerateAction, type Wind } from "../net/messages";
import { kObserveAll } from "../net/roomMessages";
import type { HairSource, MemberImportance } from "../hair/hairSource";
import { Arrivals } from "./arrivals";
import { EarlyFrames } from "./earlyFrames";
import { groomBytes } from "./groomBytes";
import { GroomQueue } from "./groomQueue";
import { Member } from "./member";
import { OwnCharacter, type CharacterOptions } from "./ownCharacter";
import { kStillAir, windOf, type WindOptions } from "./wind";

const kGroomRetryNs = 3_000_000_000;
/** how much a head outside of the view counts against one of the same size in it */
const kUnseenShare = 0.01;

/** "reconnecting": the connection is lost and the room is reconnecting; "closed": for good. */
export type RoomState = "connected" | "reconnecting" | "closed";

export interface RoomOptions extends LinkOptions {
  /**
   * About the error of hair, RMS, that is wanted where a head fills the screen, m; 0.001 by default. Where a head is
   * smaller, the error may be as much larger. 0: the least that there is.
   */
  readonly errorM?: number;
}

export interface RoomCounters extends LinkCounters {
  /** poses, winds, materials and appearances of this program that were not finite, or poses out of range */
  inputsDropped: number;
}

/** The events of a `Room`. */
export interface RoomEvents {
  /**
   * `detail`: one line with the reason, empty when connected; `isRefused`: closed, and the same request would be
   * refused again
   */
  state: { state: RoomState; detail: string; waitS: number; isRefused: boolean };
  joined: { member: Member };
  left: { member: Member };
  /** The owner has changed its tag or its appearance. */
  changed: { member: Member };
  /** The room's wind has changed, or this client has learnt of it. `session`: who has set it; 0n: the server's setting; 2^64 - 1: a client of the server that had the room before. */
  wind: { wind: Wind; session: bigint };
  /** The server refused something, or a groom is damaged: one line for people. */
  fault: { detail: string };
}

const kCharacterOptions: Readonly<Record<keyof CharacterOptions, true>> = { level: true, tag: true, appearance: true };

/**
 * Joins a room. Rejects with a one-line `HairnetError` when the first attempt fails; afterwards the room reconnects by
 * itself whenever the connection breaks.
 */
export async function connect(server: string, options: RoomOptions = {}): Promise<Room> {
  checkLinkOptions(options, { ...kLinkOptions, errorM: kObserveAll.errorM });
  const { errorM, ...rest } = options;
  const link = new Link(server, rest);
  const room = new Room(link, errorM);
  await link.connect();
  return room;
}

/**
 * All members of a room, played out smoothly; a `HairSource` for `HairScene`. It fetches grooms of other members by
 * itself. Call `sample` regularly (`HairScene.update` does): it processes the received events.
 */
export class Room implements HairSource {
  /** While true, only the groom of `fetchFirst` is asked for. */
  fetchesOnlyFirst = false;
  /** by member number, at the last `sample` */
  readonly members = new Map<number, Member>();
  readonly #own = new Map<number, OwnCharacter>();
  /** the last members of the own characters, by own number */
  readonly #ownMembers = new Map<number, Member>();
  readonly #grooms = new Map<string, Groom>();
  /** files of `#grooms`, which an own character with the same groom uploads */
  readonly #files = new Map<string, Uint8Array>();
  readonly #faults = new Map<string, string>();
  readonly #queue = new GroomQueue();
  /** the member whose groom is fetched before others */
  #first: number | null = null;
  /** grooms that no member could give, and when to ask again */
  readonly #askAgainNs = new Map<string, number>();
  readonly #listeners = new Map<keyof RoomEvents, Set<(event: never) => void>>();
  readonly #arrivals = new Arrivals();
  readonly #early = new EarlyFrames();
  readonly #dropped = new DroppedInput();
  #wind: Wind = kStillAir;
  #state: RoomState = "connected";
  #nextCharacter = 1;

  /** `errorM`: as in `RoomOptions`. */
  constructor(
    readonly link: Link,
    errorM = kObserveAll.errorM,
  ) {
    link.use((core) => {
      core.setFrameSink((frame, sampleTimeNs) => {
        const sampleNs = core.toLocalNs(sampleTimeNs);
        const arrivalNs = this.#arrivals.timeOf(sampleNs, link.nowNs());
        // After a reconnect, member numbers may mean other members until the queued events are taken: store the frames.
        const member = this.#state === "connected" ? this.members.get(frame.member) : undefined;
        if (member) member.playout.push(frame, sampleNs, arrivalNs);
        else this.#early.put(frame, sampleNs, arrivalNs);
      });
      core.downloadHairOf((groom) => this.#grooms.has(groom));
      core.send({ ...kObserveAll, errorM });
    });
  }

  get state(): RoomState {
    return this.#state;
  }

  /** This client's session, as others see it in `Member.session`; another after a server has lost it. */
  get session(): bigint {
    return this.link.core.welcome?.session ?? 0n;
  }

  /** The wind in which the room's hair moves, whoever has set it; still air before the server has told it. */
  get wind(): Wind {
    return this.#wind;
  }

  /** Whether the server let this client set the wind when it joined; a moderator may forbid it later. */
  get maySetWind(): boolean {
    return this.link.core.welcome?.maySetWind ?? true;
  }

  /** The member that is the owner's character of that number; null: not here, or not yet. */
  memberOf(session: bigint, ownerCharacter: number): Member | null {
    for (const member of this.members.values()) {
      if (member.session === session && member.ownerCharacter === ownerCharacter) return member;
    }
    return null;
  }

  get counters(): RoomCounters {
    return { ...this.link.counters, inputsDropped: this.#dropped.count };
  }

  /** The bytes of other members' grooms that are on their way, and of those that have arrived since none was. */
  get downloads(): Downloads {
    return this.link.core.downloads;
  }

  /** The delay of `member` from sampling its poses to showing them here, s; 0 without a frame. */
  delayS(member: Member): number {
    return 1e-9 * member.playout.delayNs;
  }

  on<K extends keyof RoomEvents>(event: K, listener: (event: RoomEvents[K]) => void): () => void {
    const listeners = this.#listeners.get(event) ?? new Set();
    this.#listeners.set(event, listeners);
    listeners.add(listener as (event: never) => void);
    return () => listeners.delete(listener as (event: never) => void);
  }

  sample(_nowMs: number): readonly Member[] {
    for (const event of this.link.poll()) this.#take(event);
    this.#early.take((frame, sampleNs, arrivalNs) => {
      this.members.get(frame.member)?.playout.push(frame, sampleNs, arrivalNs);
    });
    const nowNs = this.link.nowNs();
    this.#arrivals.onAwake(nowNs);
    this.#askAgain(nowNs);
    const first = this.members.get(this.#first ?? -1)?.groomKey;
    const wanted = this.#queue.next(1e-6 * nowNs, first, this.fetchesOnlyFirst);
    if (wanted) this.link.use((core) => core.requestGroom(wanted));
    const shown = [...this.members.values()];
    for (const member of shown) {
      member.sample(nowNs, this.#own.get(member.character)?.newestPose ?? null);
      member.skin = this.link.core.skinOf(member.groomKey) ?? member.skin;
    }
    return shown;
  }

  /** Asks for this member's groom before all others, as soon as it is known. Null: for none before others. */
  fetchFirst(member: number | null): void {
    this.#first = member;
  }

  reportImportance(members: readonly MemberImportance[]): void {
    const known = members.filter(({ member, screenHeight }) => {
      if (!Number.isFinite(screenHeight))
        this.#dropped.drop(`the screen height of member ${member} is ${screenHeight}`);
      return this.members.has(member) && Number.isFinite(screenHeight);
    });
    if (known.length > 0) this.link.use((core) => core.reportImportance(known));
    this.#queue.setHeights(
      known.map((each) => [
        this.members.get(each.member)!.groomKey,
        each.screenHeight * (each.inView ? 1 : kUnseenShare),
      ]),
    );
  }

  /**
   * Adds an own character with the hair of a groom file; it is visible after its first pose. Throws `HairnetError` when
   * the file is damaged, or an option is not valid.
   */
  addCharacter(groomFile: Uint8Array | ArrayBuffer, options: CharacterOptions = {}): OwnCharacter {
    checkOptions(options, kCharacterOptions, "addCharacter");
    const file = groomBytes(groomFile);
    const groomKey = hashGroom(file);
    const groom = this.#grooms.get(groomKey) ?? decodeGroom(file);
    return this.#add(groomKey, options, () => this.#keepGroom(groomKey, groom, file));
  }

  /** The same with a groom that is already in the room, by its `groomKey`. */
  addCharacterLike(member: Member, options: CharacterOptions = {}): OwnCharacter {
    checkOptions(options, kCharacterOptions, "addCharacterLike");
    if (!(member instanceof Member)) throw new HairnetError("invalid", "addCharacterLike: give one of room.members");
    return this.#add(member.groomKey, options);
  }

  removeCharacter(own: OwnCharacter): void {
    if (!(own instanceof OwnCharacter))
      throw new HairnetError("invalid", "removeCharacter: give what addCharacter returned");
    this.#own.delete(own.character);
    own.member = null;
    this.#ownMembers.delete(own.character);
    this.link.send({ type: "removeCharacter", character: own.character });
    this.#forgetUnused(own.groomKey);
  }

  /**
   * Sets the wind of the whole room, in few words (`{ speed: 3 }`) or as a `Wind`; what is absent gets its default. It
   * lasts until another client sets one, or this one leaves. One that is not finite is dropped, as by `push`.
   */
  setWind(wind: WindOptions | Partial<Wind>): void {
    const wrong = notFinite(wind ?? {});
    if (wrong) return this.#dropped.drop(`setWind: ${wrong}`);
    this.link.send({ type: "setWind", wind: windOf(wind) });
  }

  /**
   * Removes or mutes a person, or locks the room, if this client's token says `moderate`; otherwise a "fault" follows.
   * `who` is a character of the person, or the person's subject as the server's log names it ("sub:alice"); "" for
   * `lock` and `unlock`. `seconds` is how long a removed person is banned, and `reason` is for people.
   */
  moderate(action: ModerateAction, who: Member | string = "", seconds = 0, reason = ""): void {
    const [session, subject] = typeof who === "string" ? [0n, who] : [who.session, ""];
    this.link.send({ type: "moderate", action, session, subject, seconds, reason });
  }

  /** Says goodbye; the room stays empty afterwards. */
  close(): void {
    this.link.close();
    for (const member of [...this.members.values()]) this.#drop(member);
    this.#setState("closed", "", 0);
  }

  /** `keep` is called once the options have been found valid. */
  #add(groomKey: string, options: CharacterOptions, keep = () => {}): OwnCharacter {
    const own = new OwnCharacter(
      this.link,
      this.#nextCharacter,
      groomKey,
      options,
      () => this.#showOwn(own),
      this.#dropped,
    );
    const { character, tag, appearance } = own;
    const { level = LevelIndex.high } = options;
    const add = { type: "addCharacter", character, groom: groomKey, level, state: null, tag, appearance } as const;
    validateMessage(add);
    keep();
    ++this.#nextCharacter;
    const file = this.#files.get(groomKey);
    if (file) this.link.use((core) => core.offerGroom(file));
    this.#own.set(character, own);
    this.link.send(add);
    return own;
  }

  /** The newest tag and appearance of an own character, which the server tells others. */
  #showOwn({ member, tag, appearance }: OwnCharacter): void {
    if (!member) return;
    member.show(tag, appearance);
    this.#tell("changed", { member });
  }

  #take(event: LinkEvent): void {
    switch (event.type) {
      case "connected":
        for (const member of this.members.values()) if (member.own) member.session = event.welcome.session;
        return this.#setState("connected", "", 0);
      case "reconnecting":
        for (const member of this.members.values()) member.playout.freeze();
        return this.#setState("reconnecting", event.detail || "the connection broke", event.waitS);
      case "disconnected":
        for (const member of [...this.members.values()]) this.#drop(member);
        return this.#setState("closed", event.detail, 0, isFinal(event.reason));
      case "memberJoined": {
        const joined = new Member(event.member, 0, event.groom, event.session, event.character);
        joined.show(event.tag, event.appearance);
        return this.#meet(joined);
      }
      case "memberChanged": {
        const member = this.members.get(event.member);
        if (!member) return;
        member.show(event.tag, event.appearance);
        return this.#tell("changed", { member });
      }
      case "roomWind":
        this.#wind = event.wind;
        return this.#tell("wind", { wind: event.wind, session: event.session });
      case "characterAdded":
        return this.#meetOwn(event.character, event.member, event.groom);
      case "memberLeft": {
        const left = this.members.get(event.member);
        return left && this.#drop(left);
      }
      case "characterRemoved":
        for (const member of [...this.members.values()]) if (member.character === event.character) this.#drop(member);
        return;
      case "groomFetched":
        return this.#takeGroom(event.hash, event.bytes, event.fault);
      case "groomStatus":
        if (event.state === GroomState.refused) this.#tell("fault", { detail: "the server refused a groom" });
        return;
      case "error":
        if (event.groom) this.#queue.finish(event.groom);
        if (event.reason === ErrorReason.groomUnavailable || event.reason === ErrorReason.limitExceeded) {
          if (event.groom && !this.#grooms.has(event.groom)) {
            if (this.#isUsed(event.groom)) this.#askAgainNs.set(event.groom, this.link.nowNs() + kGroomRetryNs);
            return;
          }
        }
        // The hair then starts at rest.
        if (event.reason === ErrorReason.stateInvalid) return;
        return this.#tell("fault", { detail: event.detail || ErrorReason[event.reason] });
      default:
    }
  }

  // A new server gives it another number, which may have belonged to another own character; its hair continues.
  #meetOwn(character: number, number: number, groom: string): void {
    const isKnown = this.members.get(number)?.character === character;
    const own = this.#own.get(character);
    if (isKnown || !own) return;
    const former = this.#ownMembers.get(character);
    if (former && this.members.get(former.member) === former) this.#drop(former);
    const member = new Member(number, character, groom, this.session, character, former);
    member.show(own.tag, own.appearance);
    own.member = member;
    this.#ownMembers.set(character, member);
    this.#meet(member);
  }

  #meet(member: Member): void {
    const before = this.members.get(member.member);
    if (before) this.#drop(before);
    this.members.set(member.member, member);
    member.groom = this.#grooms.get(member.groomKey) ?? null;
    member.fault = this.#faults.get(member.groomKey) ?? "";
    if (!member.groom && !member.fault) this.#queue.add(member.groomKey);
    this.#tell("joined", { member });
  }

  #drop(member: Member): void {
    this.members.delete(member.member);
    const own = this.#own.get(member.character);
    if (own?.member === member) own.member = null;
    this.#forgetUnused(member.groomKey);
    this.#tell("left", { member });
  }

  #isUsed(key: string): boolean {
    return (
      [...this.members.values()].some((member) => member.groomKey === key) ||
      [...this.#own.values()].some((own) => own.groomKey === key)
    );
  }

  #forgetUnused(key: string): void {
    if (this.#isUsed(key)) return;
    this.#grooms.delete(key);
    this.#files.delete(key);
    this.#faults.delete(key);
    this.#askAgainNs.delete(key);
    this.#queue.remove(key);
  }

  #keepGroom(key: string, groom: Groom, file: Uint8Array): void {
    this.#grooms.set(key, groom);
    this.#files.set(key, file);
    this.#faults.delete(key);
    this.#askAgainNs.delete(key);
    this.#queue.remove(key);
    this.#giveGroom(key, groom, "");
  }

  #giveGroom(key: string, groom: Groom | null, fault: string): void {
    for (const member of this.members.values()) {
      if (member.groomKey !== key) continue;
      member.groom = groom;
      member.fault = fault;
    }
  }

  #takeGroom(key: string, bytes: Uint8Array | null, fault: string): void {
    this.#queue.finish(key);
    // Its members may have left, or an own character may have added the same file.
    if (!this.#isUsed(key) || this.#grooms.has(key)) return;
    let why = fault;
    if (bytes) {
      try {
        return this.#keepGroom(key, decodeGroom(bytes), bytes);
      } catch (error) {
        why = error instanceof Error ? error.message : String(error);
      }
    }
    this.#faults.set(key, why);
    this.#giveGroom(key, null, why);
    this.#tell("fault", { detail: `a hairstyle cannot be shown: ${why}` });
  }

  #askAgain(nowNs: number): void {
    for (const [key, atNs] of this.#askAgainNs) {
      if (nowNs < atNs) continue;
      this.#askAgainNs.delete(key);
      this.#queue.add(key);
    }
  }

  #setState(state: RoomState, detail: string, waitS: number, isRefused = false): void {
    this.#state = state;
    this.#tell("state", { state, detail, waitS, isRefused });
  }

  #tell<K extends keyof RoomEvents>(event: K, what: RoomEvents[K]): void {
    for (const listener of this.#listeners.get(event) ?? []) (listener as (event: RoomEvents[K]) => void)(what);
  }
}
