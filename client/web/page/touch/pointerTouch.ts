import { Plane, type Quaternion, type Ray, Vector3 } from "three";
import type { Hand, Member } from "../../src/index";
import { type Holds, isIn, type TouchedRoom } from "./holds";
import type { Picked } from "./pick";

/**
 * The shape of each press has the next number, modulo this one: a late answer to an earlier press then has another
 * number, and is ignored.
 */
const kNumbers = 16;
/** The ball at the pointer that pushes hair aside. */
const kBallRadiusM = 0.012;
/** The ball takes hold of hair within this distance of its middle. */
const kHoldRadiusM = 0.03;
/** The capsule that strokes hair. */
const kPalmRadiusM = 0.025;
const kPalmHalfLengthM = 0.04;
/**
 * The hand and the request to take hold travel separately, so the request may come first and find no hand. The client
 * repeats it after each answer without hair, for this time after the first answer.
 */
const kTakesMs = 500;
/** The ball waits this long for the first answer, and then follows the pointer without hair. */
const kAnswersMs = 2000;
/**
 * The ball moves no faster than this (2 m/s): otherwise hair would slip out of it. Above 8 m/s it would even count as a
 * hand that jumped (core/touch/touch_body.hpp).
 */
const kSpeedMPerMs = 0.002;
/** The ball stays this long where it has pinned hair: without a hand the server would drop the hair before the pin. */
const kLingersMs = 300;

interface Press {
  readonly number: number;
  readonly member: Member;
  readonly room: TouchedRoom;
  /** The rotation of the camera when the press began. */
  readonly rotation: Quaternion;
  /** The plane through the first point that faces the camera: the pointer moves in it. */
  readonly plane: Plane;
  /** The middle of the ball or palm, which may be behind the pointer (`end`). */
  readonly at: Vector3;
  /** The time at which `at` was last moved. */
  movedMs: number;
  /** Where the pointer is in the plane. */
  readonly end: Vector3;
  /** The press strokes the hair with a palm, and holds nothing. */
  readonly strokes: boolean;
  /** Until this time an answer without hair makes the client ask again. */
  takesUntilMs: number;
  /** The server has answered at least once. */
  isAnswered: boolean;
  /** An answer had hair: the ball holds it. */
  isHeld: boolean;
  /** The hair will stay where it is released. */
  pins: boolean;
}

/** A mouse or a finger as a hand: a ball that holds hair, or a palm that strokes hair. Times: `performance.now()`. */
export class PointerTouch {
  /** The press that goes on; null: no pointer is down. */
  #press: Press | null = null;
  /** The count of presses so far. */
  #number = 0;
  /** The hand of a press that has pinned its hair, which stays for kLingersMs. */
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

  /** Moves the wanted place to where the ray of the pointer meets the plane of the press. */
  move(ray: Ray): void {
    if (this.#press) ray.intersectPlane(this.#press.plane, this.#press.end);
  }

  /** A second finger touches the screen: the hair will stay where it is released. */
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

  /** The hand of the press, or the one that lingers after a pin; there is at most one. */
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

/**
 * Moves the hand of a press towards the pointer. A ball waits at the hair until it holds the hair or gives up, and then
 * follows at a limited speed. A palm follows at once.
 */
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
