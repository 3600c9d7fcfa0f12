import type { LevelIndex } from "../hair/level";
import { validatePose, type Pose } from "../hair/pose";
import type { Link } from "../net/link";
import type { MaterialScale } from "../net/messages";
import { materialOf } from "./materials";

/** One of this client's own characters in a room. */
export class OwnCharacter {
  #sequence = 0;
  #newest: Pose | null = null;

  /** Made by `Room.addCharacter`. */
  constructor(
    private readonly link: Link,
    /** this client's own number for it */
    readonly character: number,
    /** identifies its groom */
    readonly groomKey: string,
  ) {}

  /** The last pushed pose: the hair is drawn with it, and with the newest lattice. */
  get newestPose(): Pose | null {
    return this.#newest;
  }

  /**
   * Sets its current bones, world (see `Pose`); best 60 to 90 times a second. `teleport`: the pose does not continue
   * the previous one. Throws `HairnetError` when the pose is not valid.
   */
  push(pose: Pose, teleport = false): void {
    validatePose(pose);
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

  /** Replaces its material: one of `materials`, or `{ stiffness: 2 }`, where what is absent is normal. */
  setMaterial(scale: Partial<MaterialScale>): void {
    this.link.send({ type: "setMaterial", character: this.character, scale: materialOf(scale) });
  }
}
