import type { Groom } from "../hair/groom";
import { LatticeBlend, type LatticeLayer } from "../hair/latticeBlend";
import { Playout } from "../hair/playout";
import type { Pose } from "../hair/pose";
import type { GroomHash } from "../net/groomHash";

/** One character of a room, as its frames tell of it. */
export class Member {
  readonly playout: Playout;
  readonly #blend: LatticeBlend;
  groom: Groom | null = null;
  /** why its groom cannot be shown; empty: it can, or is still to come */
  fault = "";
  /** null: no frame has come */
  pose: Pose | null = null;
  layers: readonly LatticeLayer[] = [];

  constructor(
    readonly member: number,
    /** one's own number for it; 0: another's */
    readonly character: number,
    readonly groomKey: GroomHash,
    /** the same character under another number: what was shown of it goes on */
    former?: Member,
  ) {
    this.playout = former?.playout ?? new Playout();
    this.#blend = former ? former.#blend : new LatticeBlend();
  }

  get own(): boolean {
    return this.character !== 0;
  }

  /** Brings pose and layers to what is to be shown at `nowNs`. `newest`: the pose to show it with in place of the frames'. */
  sample(nowNs: number, newest: Pose | null): void {
    const sample = this.playout.sample(nowNs);
    if (!sample) {
      this.pose = newest;
      return;
    }
    this.layers = this.#blend.update(sample);
    this.pose = newest ?? sample.pose;
  }
}
