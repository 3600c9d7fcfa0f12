import type { TouchedRoom } from "../../../page/touch/holds";
import { type Hand, type Member, Release } from "../../../src/index";

/** Writes down what hands do in a room. */
export class FakeRoom implements TouchedRoom {
  state: TouchedRoom["state"] = "connected";
  readonly members = new Map<number, Member>();
  readonly calls: string[] = [];
  /** The last place at which hair was taken hold of. */
  place: readonly number[] = [];

  /** `untouchable`: a member's number. */
  constructor(
    people: readonly { readonly member: number }[],
    private readonly untouchable = -1,
  ) {
    for (const person of people) this.members.set(person.member, person as Member);
  }

  mayTouch({ member }: Member): boolean {
    return member !== this.untouchable;
  }

  pushHands(hands: readonly Hand[]): void {
    this.calls.push(`hands ${hands.length}`);
  }

  takeHold({ member }: Member, hand: number, place: readonly number[] = []): void {
    this.calls.push(`take ${member} ${hand}`);
    this.place = place;
  }

  letGo({ member }: Member, hand: number, release = Release.drop): void {
    this.calls.push(`let go ${member} ${hand} ${Release[release]}`);
  }
}
