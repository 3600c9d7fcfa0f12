import { kSilenceMs } from "../generated/limits";

const kLookEveryNs = 1e9;
/** What a look adds at most: a program, or a page in the background, may have been stopped since the last one. */
const kLookNsMax = 2e9;

export const kSilenceS = 1e-3 * kSilenceMs;
/** a peer that promised signs of life sends something at least as often */
export const kSignOfLifeNs = (1e6 * kSilenceMs) / 4;

/**
 * For how long nothing has come from the server, counted while this program could receive: what arrived while it was
 * stopped is read after the look that comes first.
 */
export class Silence {
  #ns = 0;
  #lookedNs = 0;

  onHeard(nowNs: number): void {
    this.#ns = 0;
    this.#lookedNs = nowNs;
  }

  /** Returns whether the server has been silent for too long. */
  look(nowNs: number): boolean {
    this.#ns += Math.min(nowNs - this.#lookedNs, kLookNsMax);
    this.#lookedNs = nowNs;
    return this.#ns >= 1e6 * kSilenceMs;
  }

  /** when to look again */
  get nextLookNs(): number {
    return this.#lookedNs + Math.min(kLookEveryNs, 1e6 * kSilenceMs - this.#ns);
  }
}
