import { defaultAppearance, type Appearance } from "../hair/appearance";
import type { Groom } from "../hair/groom";
import { ModeLattice } from "../hair/movedLattice";
import { Playout, type PlayoutSample } from "../hair/playout";
import type { Pose } from "../hair/pose";
import type { Skin } from "../hair/skin";
import type { GroomHash } from "../net/groomHash";
import { decodeText } from "../net/text";

/** One character of a room, from its frames. */
export class Member {
  readonly playout: Playout;
  groom: Groom | null = null;
  /** the skin to keep its hair out of; null: not received yet */
  skin: Skin | null = null;
  /** why its groom cannot be shown; empty: it can, or has not arrived yet */
  fault = "";
  /** Written at every sample; null: no frame has arrived. */
  pose: Pose | null = null;
  /** null: its hair is at rest */
  lattice: ModeLattice | null = null;
  /** Any bytes, at most 256, that the owner's application gave it. */
  tag: Uint8Array = new Uint8Array();
  /** As the owner wants it drawn; the default of its number if the owner does not say. */
  appearance: Appearance;

  constructor(
    readonly member: number,
    /** this client's own number for it; 0: another client's character */
    readonly character: number,
    readonly groomKey: GroomHash,
    /** the owner's; another after this client's session has ended and a new one begun */
    public session: bigint,
    /** the owner's own number for it: with `session` it says the same character to all clients */
    readonly ownerCharacter: number,
    /** the same character under another number: its shown state continues */
    former?: Member,
  ) {
    this.appearance = defaultAppearance(member);
    this.playout = former?.playout ?? new Playout();
  }

  get own(): boolean {
    return this.character !== 0;
  }

  /** The tag as text, such as a person's name; "" if it is no UTF-8 or has control characters. */
  get tagText(): string {
    return decodeText(this.tag) ?? "";
  }

  /** @internal `appearance` null: the default. */
  show(tag: Uint8Array, appearance: Appearance | null): void {
    this.tag = tag;
    this.appearance = appearance ?? defaultAppearance(this.member);
  }

  /** Updates pose and lattice to the state at `nowNs`. `newest`: a pose that replaces that of the frames. */
  sample(nowNs: number, newest: Pose | null): void {
    const sample = this.playout.sample(nowNs);
    if (!sample) {
      this.pose = newest;
      return;
    }
    this.#move(sample);
    this.pose = newest ?? sample.pose;
  }

  #move({ basis, coefficients }: PlayoutSample): void {
    if (this.lattice?.hair !== basis) this.lattice = basis && new ModeLattice(basis);
    this.lattice?.show(coefficients);
  }
}
