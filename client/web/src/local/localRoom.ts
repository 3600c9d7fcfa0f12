import { checkOptions } from "../hair/checkOptions";
import type { Groom } from "../hair/groom";
import { HairnetError, messageOf } from "../module/hairnetError";
import type { Instance } from "../module/instance";
import type { Member } from "../room/member";
import type { CharacterOptions, OwnCharacter } from "../room/ownCharacter";
import { People, type Happened, type RoomState } from "../room/people";
import { kStillAir, type Wind } from "../room/wind";
import { buildLevels } from "./buildLevels";
import { startLocalClient } from "./localModule";

// The limits are those of hairnet_world_make (client/hairnet.h); 60 steps a second are right for one head on a screen.
const kTickRateMinHz = 10;
const kTickRateMaxHz = 240;
const kTickRateHz = 60;

export interface LocalRoomOptions {
  /** How often the hair is stepped in a second: 10 to 240, by default 60. */
  readonly tickRateHz?: number;
}

/** How a character of a `LocalRoom` is added. */
export interface LocalCharacterOptions extends CharacterOptions {
  /**
   * The file of its hairstyle's levels, of `hairnet-groom levels` or `buildLevels`. Without it they are built in a
   * worker, and its hair is rigid for some seconds.
   */
  readonly levels?: Uint8Array | ArrayBuffer;
}

/**
 * Characters whose hair this page simulates itself: no server, no network. It is used as a `Room` is: a `HairSource`
 * for `HairScene`. Each `sample` (`HairScene.update` does it) steps the hair by the time since the last one, at most
 * 0.1 s, so a page that slept or is too slow shows slow motion.
 */
export class LocalRoom extends People {
  #state: RoomState = "connected";
  #wind = kStillAir;
  /** The time of the last `sample`. */
  #sampledMs: number | null = null;
  /** What the next `sample` tells its listeners. */
  readonly #happened: Happened[] = [];
  /**
   * The handles of hairnet_levels by the groom's key, until the room closes: hair that is put on again moves at once.
   */
  readonly #levels = new Map<string, number>();
  /** The builds that go on: how far each is, 0 to 1, by the groom's key. */
  readonly #building = new Map<string, number>();

  /** Rejects with a one-line `HairnetError` where hairnet_local.wasm cannot start. */
  static async open(options: LocalRoomOptions = {}): Promise<LocalRoom> {
    checkOptions(options, { tickRateHz: kTickRateHz }, "LocalRoom.open");
    const { tickRateHz = kTickRateHz } = options;
    if (!(tickRateHz >= kTickRateMinHz && tickRateHz <= kTickRateMaxHz))
      throw new HairnetError(
        "invalid",
        `LocalRoom.open: tickRateHz is ${tickRateHz}; it is ${kTickRateMinHz} to ${kTickRateMaxHz}`,
      );
    return new LocalRoom(await startLocalClient(), tickRateHz);
  }

  private constructor(module: Instance, tickRateHz: number) {
    // Members hold `owner` by their scene, so the world lives as long as anything shows it (`Scene.owner`).
    const owner = {};
    super(module, module.make("hairnet_world_make", tickRateHz), "hairnet_world_", owner, () => {});
    module.freeAfter(owner, "hairnet_world_free", this.handle);
  }

  /** "connected" until it is closed. */
  get state(): RoomState {
    return this.#state;
  }

  get session(): bigint {
    return 0n;
  }

  get wind(): Wind {
    return this.#wind;
  }

  get maySetWind(): boolean {
    return true;
  }

  get counters(): { readonly inputsDropped: number } {
    return { inputsDropped: this.dropped.count };
  }

  /** How far the building of levels is, 0 to 1; null: none are being built. */
  get building(): number | null {
    if (this.#building.size === 0) return null;
    return [...this.#building.values()].reduce((sum, share) => sum + share, 0) / this.#building.size;
  }

  override addCharacter(hair: Groom | Uint8Array | ArrayBuffer, options: LocalCharacterOptions = {}): OwnCharacter {
    const { levels, ...others } = { ...options };
    const groom = this.groomOf(hair);
    if (levels !== undefined) this.#takeLevels(groom, levels);
    const own = super.addCharacter(groom, others);
    this.#giveLevels(own);
    if (groom.pointCount > 0 && !this.#levels.has(groom.key)) void this.#build(groom);
    return own;
  }

  override addCharacterLike(member: Member, options: CharacterOptions = {}): OwnCharacter {
    const own = super.addCharacterLike(member, options);
    this.#giveLevels(own);
    return own;
  }

  override removeCharacter(own: OwnCharacter): void {
    super.removeCharacter(own);
    this.#happened.push({ kind: "left", member: own.character });
  }

  sample(nowMs: number): readonly Member[] {
    if (!Number.isFinite(nowMs)) {
      this.dropped.drop(`sample: the time is ${nowMs}`);
      return [...this.members.values()];
    }
    // The world itself steps by at most 0.1 s in a call.
    const seconds = Math.max(nowMs - (this.#sampledMs ?? nowMs), 0) / 1000;
    this.#sampledMs = nowMs;
    this.module.call("hairnet_world_advance", this.handle, seconds);
    return this.show(this.#happened.splice(0));
  }

  /** The room stays empty afterwards. */
  close(): void {
    if (this.#state === "closed") return;
    this.#state = "closed";
    for (const own of [...this.own.values()]) this.removeCharacter(own);
    this.show(this.#happened.splice(0));
    this.dropAll();
    for (const levels of this.#levels.values()) this.module.call("hairnet_levels_free", levels);
    this.#levels.clear();
    this.#building.clear();
    this.tell("state", { state: "closed", detail: "", waitS: 0, isRefused: false });
  }

  protected addToModule(groom: Groom, options: number): number {
    if (this.#state === "closed") throw new HairnetError("invalid", "addCharacter: the room is closed");
    const own = this.module.made("addCharacter: ", "hairnet_world_add", this.handle, groom.handle, 0, options, 0);
    this.#happened.push({ kind: "joined", member: own });
    return own;
  }

  protected override onChanged(own: OwnCharacter): void {
    this.#happened.push({ kind: "changed", member: own.character });
  }

  protected override onWind(wind: Wind): void {
    this.#wind = wind;
    this.tell("wind", { wind, session: this.session });
  }

  /** Reads a .levels file, unless the groom has levels already. */
  #takeLevels(groom: Groom, levels: Uint8Array | ArrayBuffer): void {
    if (this.#levels.has(groom.key)) return;
    const bytes = levels instanceof ArrayBuffer ? new Uint8Array(levels) : levels;
    if (!(bytes instanceof Uint8Array))
      throw new HairnetError("invalid", "levels are a Uint8Array or an ArrayBuffer: the bytes of a .levels file");
    const load = "hairnet_levels_load";
    this.#levels.set(groom.key, this.module.makeOf(load, bytes, groom.handle));
  }

  /** Lets the world step the character's hair, if the levels of its groom are known. */
  #giveLevels(own: OwnCharacter): void {
    const levels = this.#levels.get(own.groomKey);
    if (levels) this.module.call("hairnet_world_set_levels", this.handle, own.character, levels);
  }

  /** Builds the levels of a groom, and gives them to all own characters that have the groom by then. */
  async #build(groom: Groom): Promise<void> {
    if (this.#building.has(groom.key)) return;
    this.#building.set(groom.key, 0);
    try {
      const levels = await buildLevels(groom, (share) => {
        if (this.#building.has(groom.key)) this.#building.set(groom.key, share);
      });
      if (this.#state === "closed") return;
      this.#takeLevels(groom, levels);
      for (const own of this.own.values()) if (own.groomKey === groom.key) this.#giveLevels(own);
    } catch (thrown) {
      const error = messageOf(thrown);
      this.tell("error", { detail: `the hair of ${groom.name} stays rigid: ${error}` });
    } finally {
      this.#building.delete(groom.key);
    }
  }
}
