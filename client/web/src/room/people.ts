import { changedAppearance, defaultAppearance } from "../hair/appearance";
import { checkOptions } from "../hair/checkOptions";
import { DroppedInput, notFinite } from "../hair/droppedInput";
import { Groom } from "../hair/groom";
import type { HairSource } from "../hair/hairSource";
import { HairnetError } from "../module/hairnetError";
import { LevelIndex } from "../hair/level";
import type { Skin } from "../hair/skin";
import { tagBytes } from "../hair/tag";
import type { Instance } from "../module/instance";
import { Member } from "./member";
import { appearanceBytes, OwnCharacter, type CharacterHost, type CharacterOptions } from "./ownCharacter";
import { Scene } from "./shown";
import { windBytes, windOf, type Wind, type WindOptions } from "./wind";

/** "reconnecting": the connection is lost and the room is reconnecting; "closed": for good. */
export type RoomState = "connected" | "reconnecting" | "closed";

/** The events of a `Room`. */
export interface RoomEvents {
  /**
   * `detail`: one line with the reason, empty when connected; `waitS`: the time until the next attempt to reconnect, s;
   * `isRefused`: the room is closed, and the same request would be refused again.
   */
  state: { state: RoomState; detail: string; waitS: number; isRefused: boolean };
  joined: { member: Member };
  left: { member: Member };
  /** The owner has changed its tag or its appearance. */
  changed: { member: Member };
  /**
   * The room's wind has changed, or this client has learnt of it. `session`: who has set it; 0n: the server's setting;
   * 2^64 - 1: a client of the server that had the room before.
   */
  wind: { wind: Wind; session: bigint };
  /** A hand of this client holds so many points of the hair of a member; 0: it has lost them, or there was none. */
  held: { member: Member; hand: number; pointCount: number };
  /** The room's props have changed: `room.props`. */
  props: object;
  /** Another audience may touch the hair of a member: `room.mayTouch`. */
  touch: { member: Member };
  /** The server refused something, or a groom is damaged: one line for people. */
  error: { detail: string };
}

/** A member has joined, left or changed since the last sample. `member`: its number. */
export interface Happened {
  readonly kind: "joined" | "left" | "changed";
  readonly member: number;
}

/** The names of all options, for `checkOptions`. */
const kCharacterOptions: Readonly<Record<keyof CharacterOptions, true>> = { level: true, tag: true, appearance: true };
/** The size of hairnet_character_options of client/hairnet.h in WebAssembly, where pointers have 4 bytes. */
const kOptionsBytes = 20;

/** Everyone who is shown, and this program's own characters: what a `Room` and a `LocalRoom` have in common. */
export abstract class People implements HairSource {
  /** The members at the last `sample`, by member number. */
  readonly members = new Map<number, Member>();
  /** Input of this program that was not finite, or out of range, and was dropped. */
  protected readonly dropped = new DroppedInput();
  /** This client's own characters, by their own number. */
  protected readonly own = new Map<number, OwnCharacter>();
  /** The own number of the newest own character, from 1; 0: there was none. */
  #lastCharacter = 0;
  /** What the module shows of this room or world. */
  readonly #scene: Scene;
  /** The index of each member in what the module shows now (`Scene`), by member number. */
  readonly #indices = new Map<number, number>();
  /** What own characters need of this object. */
  readonly #host: CharacterHost;
  /** The grooms of members and own characters, by key: those with one groom share one object. */
  readonly #grooms = new Map<string, Groom>();
  /** The skins of the grooms, by the groom's key. */
  readonly #skins = new Map<string, Skin>();
  readonly #listeners = new Map<keyof RoomEvents, Set<(event: never) => void>>();

  /**
   * `handle`: a hairnet_room or a hairnet_world, as long as anything refers to `owner`; `prefix`: of its functions'
   * names.
   */
  protected constructor(
    protected readonly module: Instance,
    protected readonly handle: number,
    private readonly prefix: "hairnet_" | "hairnet_world_",
    owner: object,
    soon: () => void,
  ) {
    const scene = prefix === "hairnet_" ? "hairnet_room_scene" : "hairnet_world_scene";
    this.#scene = new Scene(module, module.call(scene, handle), owner);
    this.#host = { module, handle, owner, prefix, dropped: this.dropped, soon, changed: (own) => this.onChanged(own) };
  }

  abstract get state(): RoomState;
  /** This client's session, as others see it in `Member.session`. */
  abstract get session(): bigint;
  /** Poses, winds, materials and appearances of this program that were not finite, or out of range, and others. */
  abstract get counters(): { readonly inputsDropped: number };
  abstract sample(nowMs: number): readonly Member[];
  abstract close(): void;

  /** Calls `listener` for each event of this kind. Returns a function that ends this. */
  on<K extends keyof RoomEvents>(event: K, listener: (event: RoomEvents[K]) => void): () => void {
    const listeners = this.#listeners.get(event) ?? new Set();
    this.#listeners.set(event, listeners);
    listeners.add(listener as (event: never) => void);
    return () => listeners.delete(listener as (event: never) => void);
  }

  /** The wind in which the hair moves, no matter who has set it. */
  abstract get wind(): Wind;

  /**
   * Adds an own character with the hair of a groom, or of a groom's file; it is visible after its first pose. Throws
   * `HairnetError` when the file is damaged, or an option is not valid.
   */
  addCharacter(hair: Groom | Uint8Array | ArrayBuffer, options: CharacterOptions = {}): OwnCharacter {
    checkOptions(options, kCharacterOptions, "addCharacter");
    return this.#add(this.groomOf(hair), options);
  }

  /** Adds an own character with the groom of a member, which must have arrived. */
  addCharacterLike(member: Member, options: CharacterOptions = {}): OwnCharacter {
    checkOptions(options, kCharacterOptions, "addCharacterLike");
    if (!(member instanceof Member)) throw new HairnetError("invalid", "addCharacterLike: give one of room.members");
    if (!member.groom) throw new HairnetError("invalid", "addCharacterLike: its groom has not arrived yet");
    return this.#add(member.groom, options);
  }

  removeCharacter(own: OwnCharacter): void {
    if (!(own instanceof OwnCharacter))
      throw new HairnetError("invalid", "removeCharacter: give what addCharacter returned");
    this.own.delete(own.character);
    own.member = null;
    this.#forgetUnused(own.groomKey);
    const remove = this.prefix === "hairnet_" ? "hairnet_remove_character" : "hairnet_world_remove";
    this.module.call(remove, this.handle, own.character);
    this.#host.soon();
  }

  /**
   * Sets the wind of the whole room, in few words (`{ speed: 3 }`) or as a `Wind`; what is absent gets its default. The
   * wind lasts until another client sets one, or this client leaves. A wind that is not finite is dropped, as a pose is
   * by `push`.
   */
  setWind(wind: WindOptions | Partial<Wind>): void {
    const wrong = notFinite(wind ?? {});
    if (wrong) return this.dropped.drop(`setWind: ${wrong}`);
    const whole = windOf(wind);
    this.module.with(windBytes(whole), (at) =>
      this.module.check("setWind: ", `${this.prefix}set_wind`, this.handle, at),
    );
    this.#host.soon();
    this.onWind(whole);
  }

  /** The member with this session and this number of its owner (`Member.ownerCharacter`); null: there is none now. */
  memberOf(session: bigint, ownerCharacter: number): Member | null {
    for (const member of this.members.values()) {
      if (member.session === session && member.ownerCharacter === ownerCharacter) return member;
    }
    return null;
  }

  /** Adds a character to the module, and returns its own number. `options`: the address of the options' bytes. */
  protected abstract addToModule(groom: Groom, options: number): number;

  /** Called when this program has changed a tag or appearance. A server announces the change by itself. */
  protected onChanged(_own: OwnCharacter): void {}

  /** Called when this program has set the wind. A server announces the change by itself. */
  protected onWind(_wind: Wind): void {}

  /** The groom in the memory of this room's module: `hair` itself, or read again from its file. */
  protected groomOf(hair: Groom | Uint8Array | ArrayBuffer): Groom {
    if (!(hair instanceof Groom)) return Groom.of(hair, this.module);
    return hair.module === this.module ? hair : Groom.of(hair.file, this.module);
  }

  /** Brings members, grooms and skins up to what the module shows now, and tells the listeners what has `happened`. */
  protected show(happened: readonly Happened[]): readonly Member[] {
    const scene = this.#scene;
    const count = scene.read();
    const indices = this.#indices;
    indices.clear();
    for (let i = 0; i < count; ++i) indices.set(scene.memberAt(i), i);
    for (const { kind, member } of happened) {
      const index = indices.get(member);
      if (kind === "left") this.#drop(member);
      // A member without an index has left since this event.
      else if (index === undefined) continue;
      else if (kind === "joined") this.#meet(index);
      else this.#change(index);
    }
    for (const member of this.members.values()) {
      const index = indices.get(member.member);
      if (index !== undefined) this.#move(member, index);
    }
    return [...this.members.values()];
  }

  /** All members leave: the room is closed. */
  protected dropAll(): void {
    for (const member of [...this.members.keys()]) this.#drop(member);
    this.#scene.free();
  }

  /** Calls the listeners of an event. */
  protected tell<K extends keyof RoomEvents>(event: K, what: RoomEvents[K]): void {
    for (const listener of this.#listeners.get(event) ?? []) (listener as (event: RoomEvents[K]) => void)(what);
  }

  #add(groom: Groom, options: CharacterOptions): OwnCharacter {
    const { module } = this;
    const { level = LevelIndex.high } = options;
    if (!(level in LevelIndex)) throw new HairnetError("invalid", `addCharacter: there is no level ${String(level)}`);
    const tag = tagBytes(options.tag === undefined ? "" : options.tag);
    const base = defaultAppearance(this.#lastCharacter + 1);
    const appearance = options.appearance === undefined ? null : changedAppearance(base, options.appearance);
    // The fields of hairnet_character_options: 0 size, 4 level, 8 tag, 12 appearance, 16 tag_size.
    const view = new DataView(new ArrayBuffer(kOptionsBytes));
    view.setUint32(0, kOptionsBytes, true);
    view.setUint32(4, level, true);
    view.setUint32(16, tag.length, true);
    const character = module.with(tag, (tagAt) =>
      module.with(appearanceBytes(appearance ?? base), (look) => {
        view.setUint32(8, tag.length > 0 ? tagAt : 0, true);
        view.setUint32(12, appearance ? look : 0, true);
        return module.with(new Uint8Array(view.buffer), (at) => this.addToModule(groom, at));
      }),
    );
    this.#lastCharacter = character;
    this.#grooms.set(groom.key, groom);
    const own = new OwnCharacter(this.#host, character, groom.key, { tag, appearance });
    this.own.set(character, own);
    this.#host.soon();
    return own;
  }

  /** A member has joined: the character `index` of the module's scene. */
  #meet(index: number): void {
    const member = new Member(this.#scene, this.#scene.at(index));
    this.#drop(member.member);
    this.members.set(member.member, member);
    const own = this.own.get(member.character);
    if (own) own.member = member;
    this.#move(member, index);
    this.tell("joined", { member });
  }

  /** A member has another tag or appearance: the character `index` of the module's scene. */
  #change(index: number): void {
    const shown = this.#scene.at(index);
    const member = this.members.get(shown.member);
    if (!member) return;
    member.describe(shown);
    this.tell("changed", { member });
  }

  /** A member has left, or the room is closed. A number that no member has is ignored. */
  #drop(number: number): void {
    const member = this.members.get(number);
    if (!member) return;
    this.members.delete(number);
    const own = this.own.get(member.character);
    if (own?.member === member) own.member = null;
    this.#forgetUnused(member.groomKey);
    this.tell("left", { member });
  }

  /** Lets go of a groom and its skin when no member and no own character has them. */
  #forgetUnused(key: string): void {
    const isUsed = [...this.members.values(), ...this.own.values()].some((one) => one.groomKey === key);
    if (isUsed) return;
    this.#grooms.delete(key);
    this.#skins.delete(key);
  }

  /** Takes the member's motion, and its groom and skin when they have arrived. */
  #move(member: Member, index: number): void {
    const shown = this.#scene.at(index);
    member.show(shown, index);
    const key = member.groomKey;
    if (!member.groom && shown.hasHair) {
      if (!this.#grooms.has(key)) this.#grooms.set(key, this.#scene.groomOf(index));
      member.groom = this.#grooms.get(key)!;
      member.error = "";
    }
    if (member.skin || !member.groom) return;
    member.skin = this.#skins.get(key) ?? this.#scene.skinOf(index);
    if (member.skin) this.#skins.set(key, member.skin);
  }
}
