import type { Groom } from "../hair/groom";
import { LatticeBlend, type LatticeLayer } from "../hair/latticeBlend";
import { Playout } from "../hair/playout";
import type { Pose } from "../hair/pose";
import type { GroomHash } from "../net/groomHash";

/** One character of a room, from its frames. */
export class Member {
  readonly playout: Playout;
  readonly #blend: LatticeBlend;
  groom: Groom | null = null;
  /** why its groom cannot be shown; empty: it can, or has not arrived yet */
  fault = "";
  /** null: no frame has arrived */
  pose: Pose | null = null;
  layers: readonly LatticeLayer[] = [];

  constructor(
    readonly member: number,
    /** this client's own number for it; 0: another client's character */
    readonly character: number,
    readonly groomKey: GroomHash,
    /** the owner's; 0n: this client's */
    readonly session: bigint,
    /** the same character under another number: its shown state continues */
    former?: Member,
  ) {
    this.playout = former?.playout ?? new Playout();
    this.#blend = former ? former.#blend : new LatticeBlend();
  }

  get own(): boolean {
    return this.character !== 0;
  }

  /** Updates pose and layers to the state at `nowNs`. `newest`: a pose that replaces that of the frames. */
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
