import type { Member } from "../../src/index";
import { isClosed, type TrackedHand } from "./handsOfHeadset";
import { inAxesOfShape } from "./handShapes";
import type { Holds, TouchedRoom } from "./holds";
import { nearestHair } from "./pick";

/** The state of one hand. */
interface Side {
  isClosed: boolean;
  /** The member whose hair this hand holds. */
  member: Member | null;
  /** The headset tracks this hand in the current frame. */
  isHere: boolean;
}

/** Hands of a headset: a pinch or a trigger takes hold of the nearest hair that it may touch. */
export class HeadsetTouch {
  /** The hands, each by the first number of its shapes. */
  readonly #sides = new Map<number, Side>();

  constructor(private readonly holds: Holds) {}

  /** Takes the hands of this frame. A hand that is not tracked is forgotten, and starts open when it is back. */
  update(tracked: readonly TrackedHand[], room: TouchedRoom): void {
    for (const side of this.#sides.values()) side.isHere = false;
    for (const one of tracked) this.#move(one, room);
    for (const [number, side] of this.#sides) if (!side.isHere) this.#sides.delete(number);
  }

  /** Forgets all hands, without a word to the room. */
  forget(): void {
    this.#sides.clear();
  }

  #move(one: TrackedHand, room: TouchedRoom): void {
    const { firstNumber } = one.hand;
    const side = this.#sides.get(firstNumber) ?? { isClosed: false, member: null, isHere: true };
    this.#sides.set(firstNumber, side);
    side.isHere = true;
    const wasClosed = side.isClosed;
    side.isClosed = isClosed(one.openM, wasClosed);
    if (side.isClosed && !wasClosed) side.member = this.#take(one, room);
    if (side.isClosed || side.member === null) return;
    this.holds.letGo(room, side.member, one.number, one.pins);
    side.member = null;
  }

  /** Takes hold of the nearest hair that the user may touch; null: none is near. */
  #take({ hand, number, place, holdRadiusM }: TrackedHand, room: TouchedRoom): Member | null {
    if (room.state !== "connected") return null;
    const mine = [...room.members.values()].filter((one) => room.mayTouch(one) && one !== this.holds.drawnElsewhere);
    const member = nearestHair(place, holdRadiusM, mine);
    if (member === null) return null;
    room.takeHold(member, number, inAxesOfShape(hand, number, place), holdRadiusM);
    this.holds.hasTouched = true;
    return member;
  }
}
