import { toEarlier, type EarlierPose } from "./earlierPose";
import type { PoseBatch, PoseSample } from "./messages";

// Of a character; still older ones would come too late.
const kPosesMax = 2;
// Before the pose that they are sent with.
const kAgeMaxNs = 200e6;

/** The poses that were sent last, which the next datagrams bring again: a lost one then costs nothing. No I/O. */
export class SentPoses {
  /** of each character, oldest first */
  readonly #sent = new Map<number, readonly PoseSample[]>();

  /** Returns the batch with its earlier poses, and stores its own. */
  repeatIn({ poses }: PoseBatch): PoseBatch {
    const earlier: EarlierPose[] = [];
    const characters = new Set<number>();
    for (const pose of poses) {
      if (characters.has(pose.character)) continue;
      characters.add(pose.character);
      for (const sent of this.#sent.get(pose.character) ?? []) {
        const isOld = pose.captureTimeNs - sent.captureTimeNs > kAgeMaxNs;
        const fitting = isOld ? null : toEarlier(sent, pose);
        if (fitting) earlier.push(fitting);
      }
    }
    for (const pose of poses)
      this.#sent.set(pose.character, [...(this.#sent.get(pose.character) ?? []), pose].slice(-kPosesMax));
    return { type: "poseBatch", poses, earlier };
  }

  forget(character: number): void {
    this.#sent.delete(character);
  }

  clear(): void {
    this.#sent.clear();
  }
}
