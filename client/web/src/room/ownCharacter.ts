import { changedAppearance, defaultAppearance, type Appearance } from "../hair/appearance";
import { notFinite, type DroppedInput } from "../hair/droppedInput";
import { HairnetError } from "../module/hairnetError";
import type { LevelIndex } from "../hair/level";
import { kPoseNumbers, poseFormError, poseNumberError, type Pose } from "../hair/pose";
import { tagBytes } from "../hair/tag";
import type { Instance } from "../module/instance";
import { materialBytes, materialOf, type MaterialScale } from "./materials";
import type { Member } from "./member";

/** How an own character is added. */
export interface CharacterOptions {
  /** The finest level that the character may have; by default high. */
  readonly level?: LevelIndex;
  /** Any bytes, at most 256; text becomes UTF-8. By convention it is the person's name. */
  readonly tag?: Uint8Array | string;
  /**
   * How everyone draws the character; a `hairRoot` alone colours the whole hair. Without it everyone chooses the same
   * default, by the member's number.
   */
  readonly appearance?: Partial<Appearance>;
}

/** The room or world of the module that a character belongs to. */
export interface CharacterHost {
  readonly module: Instance;
  /** A hairnet_room or a hairnet_world of the module. */
  readonly handle: number;
  /** The object that keeps the handle alive (`Instance.freeAfter`). */
  readonly owner: object;
  /** How the names of the handle's functions begin: "hairnet_" for a room, "hairnet_world_" for a world. */
  readonly prefix: string;
  readonly dropped: DroppedInput;
  /** Called when there is something to send. */
  soon(): void;
  /** Called when the character has another tag or appearance. */
  changed(own: OwnCharacter): void;
}

/** One of this client's own characters in a room. */
export class OwnCharacter {
  /** The pose that was pushed last. */
  #newest: Pose | null = null;
  #tag: Uint8Array;
  /** What the program has chosen; null: it has chosen nothing, and the member has the default of its number. */
  #appearance: Appearance | null;
  /** The character as a member of the room; null: the server has not added it yet. */
  member: Member | null = null;

  /** Made by `Room.addCharacter`. */
  constructor(
    private readonly host: CharacterHost,
    /** This client's own number of the character. */
    readonly character: number,
    /** Identifies the groom. */
    readonly groomKey: string,
    { tag, appearance }: { readonly tag: Uint8Array; readonly appearance: Appearance | null },
  ) {
    this.#tag = tag;
    this.#appearance = appearance;
  }

  get tag(): Uint8Array {
    return this.#tag;
  }

  /** The appearance that this program has set; null: the default of the member's number. */
  get appearance(): Appearance | null {
    return this.#appearance;
  }

  /** The last pushed pose: the hair is drawn with it, and with the newest lattice. */
  get newestPose(): Pose | null {
    return this.#newest;
  }

  /**
   * Sets its current bones, world (see `Pose`); best 60 to 90 times a second. `teleport`: the pose does not continue
   * the previous one, so hair does not swing after the jump: it starts at rest there. A pose that is not finite, not
   * made of rotations, or more than 10 km away is dropped, counted in `room.counters.inputsDropped` and reported on the
   * console; the character stays where it was. Throws `HairnetError` for what is no pose.
   */
  push(pose: Pose, teleport = false): void {
    const none = poseFormError(pose);
    if (none) throw new HairnetError("invalid", none);
    const error = poseNumberError(pose);
    if (error) return this.#drop("push", error);
    const { module, handle, prefix } = this.host;
    module.struct(8 * kPoseNumbers, (at) => {
      module.doubles(at, kPoseNumbers).set(pose);
      module.call(`${prefix}push_pose`, handle, this.character, at, Number(teleport));
    });
    this.#newest = Float64Array.from(pose);
    this.host.soon();
  }

  /** Sets the finest level that the character may have. */
  setLevel(level: LevelIndex): void {
    const { module, handle, prefix } = this.host;
    module.call(`${prefix}set_level`, handle, this.character, level);
    this.host.soon();
  }

  /**
   * Changes how everyone draws the character, and its tag if one is given; the hair goes on moving. What `appearance`
   * does not name stays as it is. Others learn of changes at most four times a second. Throws `HairnetError` when the
   * appearance or the tag is not valid.
   */
  setAppearance(appearance: Partial<Appearance>, tag: Uint8Array | string = this.#tag): void {
    const wrong = notFinite(appearance ?? {});
    if (wrong) return this.#drop("setAppearance", wrong);
    const bytes = tagBytes(tag);
    const base = this.#appearance ?? this.member?.appearance ?? defaultAppearance(this.character);
    this.#appearance = changedAppearance(base, appearance);
    this.#tag = bytes;
    const { module, handle, prefix } = this.host;
    module.with(appearanceBytes(this.#appearance), (look) =>
      module.with(bytes, (text) =>
        module.check("", `${prefix}set_appearance`, handle, this.character, text, bytes.length, look),
      ),
    );
    if (this.member) Object.assign(this.member, { tag: this.#tag, appearance: this.#appearance });
    this.host.changed(this);
    this.host.soon();
  }

  /** Replaces the material: by one of `materials`, or by `{ stiffness: 2 }`, where what is absent is normal. */
  setMaterial(scale: Partial<MaterialScale>): void {
    const wrong = notFinite(scale ?? {});
    if (wrong) return this.#drop("setMaterial", wrong);
    const { module, handle, prefix } = this.host;
    module.with(materialBytes(materialOf(scale)), (at) =>
      module.check("setMaterial: ", `${prefix}set_material`, handle, this.character, at),
    );
    this.host.soon();
  }

  /** Counts a call whose numbers are wrong, and tells of it on the console, instead of ending the render loop. */
  #drop(call: string, error: string): void {
    this.host.dropped.drop(`${call} of character ${this.character}: ${error}`);
  }
}

/** The bytes of a hairnet_appearance (client/hairnet.h). */
export function appearanceBytes({ hairRoot, hairTip, skin, roughness }: Appearance): Uint8Array {
  const view = new DataView(new ArrayBuffer(16));
  for (const [i, colour] of [hairRoot, hairTip, skin].entries()) view.setUint32(4 * i, colour, true);
  view.setFloat32(12, roughness, true);
  return new Uint8Array(view.buffer);
}
