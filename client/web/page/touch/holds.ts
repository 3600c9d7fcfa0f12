import { type Member, Release, type Room } from "../../src/index";

/** What touching needs of a room. */
export type TouchedRoom = Pick<Room, "state" | "members" | "mayTouch" | "pushHands" | "takeHold" | "letGo">;

/** What this user's hands have held. */
export class Holds {
  hasTouched = false;
  /** drawn elsewhere than it is in the room, so a hand at its hair would not be there: an avatar of another size */
  drawnElsewhere: Member | null = null;
  /** with hair that they have pinned */
  readonly #pinned = new Set<Member>();

  get hasPinned(): boolean {
    return this.#pinned.size > 0;
  }

  letGo(room: TouchedRoom, member: Member, hand: number, pins: boolean): void {
    if (!isIn(room, member)) return;
    room.letGo(member, hand, pins ? Release.pin : Release.drop);
    if (pins) this.#pinned.add(member);
  }

  /** Ends the user's pins, and everyone's in the user's own hair. */
  unpin(room: TouchedRoom, own: Member | null): void {
    if (own) this.#pinned.add(own);
    if (room.state !== "connected") return;
    for (const member of this.#pinned) if (isIn(room, member)) room.letGo(member, 0, Release.unpin);
    this.#pinned.clear();
  }

  /** The room is another one, or none. */
  forget(): void {
    this.#pinned.clear();
  }
}

/** It has not left since, and the server hears of it. */
export function isIn(room: TouchedRoom, member: Member): boolean {
  return room.state === "connected" && room.members.get(member.member) === member;
}
