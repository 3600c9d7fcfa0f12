import { LevelIndex } from "../hair/level";
import { validatePose, type Pose } from "../hair/pose";
import type { Link } from "../net/link";
import type { MaterialScale } from "../net/messages";

/** A character of one's own in a room. */
export class OwnCharacter {
  #sequence = 0;
  #newest: Pose | null = null;

  /** Made by `Room.addCharacter`. */
  constructor(
    private readonly link: Link,
    /** this client's own number for it */
    readonly character: number,
    /** names its groom */
    readonly groomKey: string,
  ) {}

  /** The pose that was pushed last: its hair is drawn with it, and with the newest lattice there is. */
  get newestPose(): Pose | null {
    return this.#newest;
  }

  /**
   * Where its bones are now, world (see `Pose`); best 60 to 90 times a second. `teleport`: does not continue from the
   * pose before. Throws `HairnetError` when the pose is not sound.
   */
  push(pose: Pose, teleport = false): void {
    validatePose(pose);
    this.#newest = pose.slice();
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

  setMaterial(scale: MaterialScale): void {
    this.link.send({ type: "setMaterial", character: this.character, scale: { ...scale } });
  }
}
