import { Plane, type Quaternion, type Ray, Vector3 } from "three";
import type { Hand, Member } from "../../src/index";
import { type Holds, isIn, type TouchedRoom } from "./holds";
import type { Picked } from "./pick";

/** Each press has the next number: answers to the presses before are none to it. */
const kNumbers = 16;
const kBallRadiusM = 0.012;
const kHoldRadiusM = 0.03;
const kPalmRadiusM = 0.025;
const kPalmHalfLengthM = 0.04;
/**
 * The hand and the word that it takes hold travel apart: it is said again until the hand has arrived, for so long after
 * the first answer.
 */
const kTakesMs = 500;
/** Without an answer the ball waits so long. */
const kAnswersMs = 2000;
/** Faster the hair would slip out of the hand, or the hand jump. */
const kSpeedMPerMs = 0.002;
/** So long it stays where it has pinned hair: without it the hair would be let go before that word arrives. */
const kLingersMs = 300;

interface Press {
  readonly number: number;
  readonly member: Member;
  readonly room: TouchedRoom;
  /** the camera's */
  readonly rotation: Quaternion;
  /** through where it began, facing the camera */
  readonly plane: Plane;
  /** where the ball is */
  readonly at: Vector3;
  movedMs: number;
  readonly end: Vector3;
  readonly strokes: boolean;
  takesUntilMs: number;
  isAnswered: boolean;
  isHeld: boolean;
  pins: boolean;
}

/** A mouse or a finger as a hand: a ball that holds hair, or a palm that strokes it. Times are of `performance.now()`. */
export class PointerTouch {
  #press: Press | null = null;
  #number = 0;
  #leaving: { readonly hand: Hand; readonly untilMs: number } | null = null;

  constructor(private readonly holds: Holds) {}

  get isPressed(): boolean {
    return this.#press !== null;
  }

  /** Begins at a place in hair. `rotation`: the camera's. */
  press({ member, place }: Picked, rotation: Quaternion, strokes: boolean, room: TouchedRoom, nowMs: number): void {
    const plane = new Plane().setFromNormalAndCoplanarPoint(new Vector3(0, 0, 1).applyQuaternion(rotation), place);
    this.#leaving = null;
    this.#press = {
      number: this.#number++ % kNumbers,
      member,
      room,
      rotation: rotation.clone(),
      plane,
      at: place.clone(),
      movedMs: nowMs,
      end: place.clone(),
      strokes,
      takesUntilMs: nowMs + kAnswersMs,
      isAnswered: false,
      isHeld: false,
      pins: false,
    };
    this.holds.hasTouched = true;
    room.pushHands(this.hands(nowMs));
    if (!strokes) this.#take(this.#press);
  }

  /** The pointer points there. */
  move(ray: Ray): void {
    if (this.#press) ray.intersectPlane(this.#press.plane, this.#press.end);
  }

  /** A second finger: hair will stay where it is let go. */
  pinLater(): void {
    if (this.#press) this.#press.pins = true;
  }

  release(pins: boolean, nowMs: number): void {
    const press = this.#press;
    if (!press) return;
    const isPinned = pins || press.pins;
    if (!press.strokes) {
      this.holds.letGo(press.room, press.member, press.number, isPinned);
      if (isPinned) this.#leaving = { hand: handOf(press, nowMs), untilMs: nowMs + kLingersMs };
    }
    this.#press = null;
  }

  /** The room is another one, or none. */
  forget(): void {
    this.#press = null;
    this.#leaving = null;
  }

  /** The server's answer. */
  onHeld(member: Member, hand: number, pointCount: number, nowMs: number): void {
    const press = this.#press;
    if (!press || press.strokes || hand !== press.number || member !== press.member) return;
    if (!press.isAnswered) press.takesUntilMs = nowMs + kTakesMs;
    press.isAnswered = true;
    if (pointCount > 0) press.isHeld = true;
    else if (isTaking(press, nowMs)) this.#take(press);
  }

  /** At most one. */
  hands(nowMs: number): Hand[] {
    if (this.#press) return [handOf(this.#press, nowMs)];
    if (this.#leaving && nowMs >= this.#leaving.untilMs) this.#leaving = null;
    return this.#leaving ? [this.#leaving.hand] : [];
  }

  #take({ number, member, room }: Press): void {
    if (isIn(room, member)) room.takeHold(member, number, [0, 0, 0], kHoldRadiusM);
  }
}

function isTaking({ strokes, isHeld, takesUntilMs }: Press, nowMs: number): boolean {
  return !strokes && !isHeld && nowMs < takesUntilMs;
}

/** A ball that does not hold yet waits where the hair is; then it follows the pointer, a palm does so at once. */
function move(press: Press, nowMs: number): void {
  const apart = press.end.clone().sub(press.at);
  const farthestM = press.strokes ? Infinity : kSpeedMPerMs * (nowMs - press.movedMs);
  if (!isTaking(press, nowMs)) {
    if (apart.length() <= farthestM) press.at.copy(press.end);
    else press.at.add(apart.setLength(farthestM));
  }
  press.movedMs = nowMs;
}

function handOf(press: Press, nowMs: number): Hand {
  move(press, nowMs);
  const halfM = press.strokes ? kPalmHalfLengthM : 0;
  return {
    firstNumber: press.number,
    rotation: press.rotation.toArray(),
    position: press.at.toArray(),
    shapes: [{ from: [-halfM, 0, 0], to: [halfM, 0, 0], radiusM: press.strokes ? kPalmRadiusM : kBallRadiusM }],
  };
}
