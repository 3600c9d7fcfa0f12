import { type Member, Release, type Room } from "../../src/index";

/** What touching needs of a room. */
export type TouchedRoom = Pick<Room, "state" | "members" | "mayTouch" | "pushHands" | "takeHold" | "letGo">;

/** What this user's hands have held and pinned, by mouse, finger or headset alike. */
export class Holds {
  /** The user has touched hair once, and needs the hint about it no more. */
  hasTouched = false;
  /**
   * The member whose hair is drawn elsewhere than it is in the room: the user's own on an avatar of another size. A
   * hand at the drawn hair would be elsewhere in the room, so no hand takes hold of it.
   */
  drawnElsewhere: Member | null = null;
  /** The members in whose hair this user has made pins. */
  readonly #pinned = new Set<Member>();

  get hasPinned(): boolean {
    return this.#pinned.size > 0;
  }

  /** Lets go of the hair that `hand` holds. `pins`: the hair stays where it is, instead of falling. */
  letGo(room: TouchedRoom, member: Member, hand: number, pins: boolean): void {
    if (!isIn(room, member)) return;
    room.letGo(member, hand, pins ? Release.pin : Release.drop);
    if (pins) this.#pinned.add(member);
  }

  /** Ends the user's pins, and everyone's in the user's own hair. */
  unpin(room: TouchedRoom, own: Member | null): void {
    if (own) this.#pinned.add(own);
    if (room.state !== "connected") return;
    // 0 stands for any hand: `Release.unpin` ends pins whatever the hand.
    for (const member of this.#pinned) if (isIn(room, member)) room.letGo(member, 0, Release.unpin);
    this.#pinned.clear();
  }

  /** The page has left the room, and its pins with it. */
  forget(): void {
    this.#pinned.clear();
  }
}

/** Whether the member is still in the room, and the server can be reached. */
export function isIn(room: TouchedRoom, member: Member): boolean {
  return room.state === "connected" && room.members.get(member.member) === member;
}
