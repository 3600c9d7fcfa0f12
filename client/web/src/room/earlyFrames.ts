import type { Frame } from "../hair/frame";

const kMembersMax = 4096;

/**
 * Frames of members that are not known yet. The first frame of a member may arrive before its `memberJoined` event is
 * processed, and a sleeping member sends no second one. Stores the newest frame of each member.
 */
export class EarlyFrames {
  readonly #frames = new Map<number, { frame: Frame; sampleNs: number; arrivalNs: number }>();

  put(frame: Frame, sampleNs: number, arrivalNs: number): void {
    if (this.#frames.size >= kMembersMax && !this.#frames.has(frame.member)) return;
    this.#frames.set(frame.member, { frame, sampleNs, arrivalNs });
  }

  /** Passes on all frames, and forgets them: a member that is still unknown then has left. */
  take(push: (frame: Frame, sampleNs: number, arrivalNs: number) => void): void {
    for (const { frame, sampleNs, arrivalNs } of this.#frames.values()) push(frame, sampleNs, arrivalNs);
    this.#frames.clear();
  }
}
