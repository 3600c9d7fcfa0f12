import { changedAppearance, defaultAppearance, type Appearance } from "../hair/appearance";
import type { LevelIndex } from "../hair/level";
import type { DroppedInput } from "../hair/droppedInput";
import { notFinite } from "../hair/droppedInput";
import { HairnetError } from "../hair/hairnetError";
import { poseFormFault, poseNumberFault, type Pose } from "../hair/pose";
import { tagBytes } from "../net/appearanceCodec";
import type { Link } from "../net/link";
import type { MaterialScale } from "../net/messages";
import { materialOf } from "./materials";
import type { Member } from "./member";

/** How an own character is added. */
export interface CharacterOptions {
  /** the finest level that it may have; high */
  readonly level?: LevelIndex;
  /** any bytes, at most 256; text as UTF-8. By convention the person's name */
  readonly tag?: Uint8Array | string;
  /** how everyone draws it; a `hairRoot` alone colours the whole hair. None: everyone chooses the same by its number */
  readonly appearance?: Partial<Appearance>;
}

/** One of this client's own characters in a room. */
export class OwnCharacter {
  #sequence = 0;
  #newest: Pose | null = null;
  #tag: Uint8Array;
  #appearance: Appearance | null;
  /** Its member of the room; null: the server has not added it yet. */
  member: Member | null = null;

  /** Made by `Room.addCharacter`. */
  constructor(
    private readonly link: Link,
    /** this client's own number for it */
    readonly character: number,
    /** identifies its groom */
    readonly groomKey: string,
    { tag, appearance }: CharacterOptions,
    private readonly onChanged: () => void,
    private readonly dropped: DroppedInput,
  ) {
    this.#tag = tagBytes(tag === undefined ? "" : tag);
    this.#appearance = appearance === undefined ? null : this.#changed(appearance);
  }

  get tag(): Uint8Array {
    return this.#tag;
  }

  /** null: the default of its number */
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
   * made of rotations, or more than 10 km away is dropped, counted in `room.counters.inputsDropped` and told on the
   * console; the character stays where it was. Throws `HairnetError` for what is no pose.
   */
  push(pose: Pose, teleport = false): void {
    const none = poseFormFault(pose);
    if (none) throw new HairnetError("invalid", none);
    const fault = poseNumberFault(pose);
    if (fault) return this.#drop("push", fault);
    this.#newest = Float64Array.from(pose);
    this.#sequence = (this.#sequence + 1) >>> 0;
    const sample = {
      character: this.character,
      sequence: this.#sequence,
      captureTimeNs: this.link.nowNs(),
      teleport,
      pose: this.#newest,
    };
    this.link.use((core) => core.pushPoses([sample]));
  }

  /** The finest level that it may have. */
  setLevel(level: LevelIndex): void {
    this.link.send({ type: "setLevel", character: this.character, level });
  }

  /**
   * Changes how everyone draws it, and its tag if one is given; its hair continues. What `appearance` does not name stays
   * as it is. Others learn of it at most four times a second. Throws `HairnetError` when one of them is not valid.
   */
  setAppearance(appearance: Partial<Appearance>, tag: Uint8Array | string = this.#tag): void {
    const wrong = notFinite(appearance ?? {});
    if (wrong) return this.#drop("setAppearance", wrong);
    const bytes = tagBytes(tag);
    this.#appearance = this.#changed(appearance);
    this.#tag = bytes;
    this.link.send({
      type: "setAppearance",
      character: this.character,
      tag: this.#tag,
      appearance: this.#appearance,
    });
    this.onChanged();
  }

  #changed(changes: Partial<Appearance>): Appearance {
    const base = this.#appearance ?? this.member?.appearance ?? defaultAppearance(this.character);
    return changedAppearance(base, changes);
  }

  /** Replaces its material: one of `materials`, or `{ stiffness: 2 }`, where what is absent is normal. */
  setMaterial(scale: Partial<MaterialScale>): void {
    const wrong = notFinite(scale ?? {});
    if (wrong) return this.#drop("setMaterial", wrong);
    this.link.send({ type: "setMaterial", character: this.character, scale: materialOf(scale) });
  }

  #drop(call: string, fault: string): void {
    this.dropped.drop(`${call} of character ${this.character}: ${fault}`);
  }
}
