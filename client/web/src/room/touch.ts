import { HairnetError } from "../module/hairnetError";
import type { Instance } from "../module/instance";

type Triple = readonly [number, number, number];
type Quaternion = readonly [number, number, number, number];

/** A sphere, or a capsule from one point to another, in its hand's own axes, m. */
export interface HandShape {
  readonly from: Triple;
  /** The shape is a sphere where this equals `from`. */
  readonly to: Triple;
  readonly radiusM: number;
  /** Hair is kept inside of the shape instead of outside; false by default. */
  readonly isInsideOut?: boolean;
}

/** Shapes that move together: a hand, a controller, a brush; `hairnet_hand` of client/hairnet.h. */
export interface Hand {
  /** The number of its first shape. The shapes of one person have numbers below 32, which ascend from hand to hand. */
  readonly firstNumber: number;
  /** The rotation from the hand's own axes to the world, x y z w, and the place of their origin, m. */
  readonly rotation: Quaternion;
  readonly position: Triple;
  readonly shapes: readonly HandShape[];
  /** The hand did not move here continuously, so it sweeps no hair along; false by default. */
  readonly hasJumped?: boolean;
}

/** A shape of the room itself, over which hair falls; `hairnet_touch_body` of client/hairnet.h. */
export interface Prop {
  /** The prop's number in the room, below 128. Setting another prop of the number replaces this one. */
  readonly number: number;
  readonly shape: PropShape;
  /** Half the size on each of its own axes, m, for the shapes that have it (`PropShape`); 0 0 0 by default. */
  readonly halfSizeM?: Triple;
  /** The radius of a sphere or a capsule, m; 0 by default. */
  readonly radiusM?: number;
  /** The rotation from the prop's own axes to the world, x y z w, and the place of their origin, m. */
  readonly rotation: Quaternion;
  readonly position: Triple;
  readonly isInsideOut?: boolean;
  /** The prop did not move here continuously from its last place; false by default. */
  readonly hasJumped?: boolean;
}

/** What a prop is made of; `hairnet_shape` of client/hairnet.h. */
export enum PropShape {
  /** A ball of `radiusM`. */
  sphere,
  /** Everything within `radiusM` of a line along y, which reaches `halfSizeM[1]` to both sides of the middle. */
  capsule,
  /** A box that reaches `halfSizeM` to both sides of its middle. */
  box,
  /** Everything below the plane is solid. Its normal is +y. */
  plane,
}

/** Who may touch a character's hair; `hairnet_audience` of client/hairnet.h. */
export enum TouchAudience {
  nobody,
  oneself,
  /** The owner, and the sessions that the owner names (`Room.setTouch`). */
  chosen,
  everyone,
}

/** How a hand lets go of hair; `hairnet_release` of client/hairnet.h. */
export enum Release {
  drop,
  /** The hair stays where it is, relative to the head. */
  pin,
  /** Ends all pins that this client has made at the member. At an own member it ends the pins of everyone. */
  unpin,
}

// The sizes of hairnet_hand, hairnet_hand_shape and hairnet_touch_body in the module: pointers have 4 bytes there.
const kHandBytes = 80;
const kHandShapeBytes = 32;
const kPropBytes = 96;
/** The default of `Prop.halfSizeM`. */
const kZero: Triple = [0, 0, 0];

/** Throws `HairnetError` where a value has another type than `Hand` says. */
export function checkHands(hands: readonly Hand[]): void {
  checkList(hands, "pushHands", "hands");
  for (const hand of hands) {
    checkNumber(hand?.firstNumber, "pushHands", "firstNumber");
    checkNumbers(hand.rotation, 4, "pushHands", "rotation");
    checkNumbers(hand.position, 3, "pushHands", "position");
    checkList(hand.shapes, "pushHands", "shapes");
    for (const shape of hand.shapes)
      for (const end of [shape?.from, shape?.to]) checkNumbers(end, 3, "pushHands", "an end of a shape");
  }
}

/**
 * Calls `call` with the address of these hands as the module takes them: a list of hairnet_hand, each with the address
 * of its hairnet_hand_shape. Both are freed afterwards.
 */
export function withHands(module: Instance, hands: readonly Hand[], call: (at: number) => void): void {
  const shapes = hands.flatMap((hand) => hand.shapes);
  const shapeView = new DataView(new ArrayBuffer(kHandShapeBytes * shapes.length));
  shapes.forEach(({ from, to, radiusM, isInsideOut = false }, i) => {
    const at = kHandShapeBytes * i;
    putFloats(shapeView, at, [...from, ...to, radiusM]);
    shapeView.setUint32(at + 28, Number(isInsideOut), true);
  });
  module.with(bytesOf(shapeView), (shapesAt) => {
    const view = new DataView(new ArrayBuffer(kHandBytes * hands.length));
    // `ownAt` is the address of the next hand's first shape. All shapes lie one behind the other from `shapesAt` on.
    let ownAt = shapesAt;
    hands.forEach(({ firstNumber, rotation, position, shapes: own, hasJumped = false }, i) => {
      const at = kHandBytes * i;
      // The session, the first 8 bytes, stays 0: the module does not read it here.
      putDoubles(view, at + 8, [...rotation, ...position]);
      view.setUint32(at + 64, ownAt, true);
      view.setUint32(at + 68, own.length, true);
      view.setUint32(at + 72, firstNumber, true);
      view.setUint32(at + 76, Number(hasJumped), true);
      ownAt += kHandShapeBytes * own.length;
    });
    module.with(bytesOf(view), call);
  });
}

/** The hands of others in a hairnet_room, by session. */
export function handsOf(module: Instance, room: number): Map<bigint, Hand[]> {
  const hands = new Map<bigint, Hand[]>();
  readAll(module, "hairnet_get_hands", room, kHandBytes, (view, at) => {
    const shapesAt = view.getUint32(at + 64, true);
    const session = view.getBigUint64(at, true);
    const theirs = hands.get(session) ?? [];
    hands.set(session, theirs);
    theirs.push({
      shapes: Array.from({ length: view.getUint32(at + 68, true) }, (_, i) => {
        const shape = shapesAt + kHandShapeBytes * i;
        return {
          from: tripleOf(view, shape),
          to: tripleOf(view, shape + 12),
          radiusM: view.getFloat32(shape + 24, true),
          isInsideOut: view.getUint32(shape + 28, true) !== 0,
        };
      }),
      ...placeAt(view, at + 8),
      firstNumber: view.getUint32(at + 72, true),
      hasJumped: view.getUint32(at + 76, true) !== 0,
    });
  });
  return hands;
}

/** The props as a list of hairnet_touch_body. Its first field, the toucher, stays 0 for a prop. */
export function propBytes(props: readonly Prop[]): Uint8Array {
  checkList(props, "setProps", "props");
  const view = new DataView(new ArrayBuffer(kPropBytes * props.length));
  props.forEach((prop, i) => {
    checkNumber(prop?.number, "setProps", "the number of a prop");
    const { number, shape, halfSizeM = kZero, radiusM = 0, rotation, position } = prop;
    checkNumbers(halfSizeM, 3, "setProps", "halfSizeM");
    checkNumbers(rotation, 4, "setProps", "rotation");
    checkNumbers(position, 3, "setProps", "position");
    if (!(shape in PropShape)) throw new HairnetError("invalid", `setProps: there is no shape ${String(shape)}`);
    const at = kPropBytes * i;
    view.setUint32(at + 4, number, true);
    view.setUint32(at + 8, shape, true);
    view.setUint32(at + 12, Number(prop.isInsideOut ?? false), true);
    view.setUint32(at + 16, Number(prop.hasJumped ?? false), true);
    putFloats(view, at + 20, [...halfSizeM, radiusM]);
    putDoubles(view, at + 40, [...rotation, ...position]);
  });
  return bytesOf(view);
}

/** The props of a hairnet_room, by number. */
export function propsOf(module: Instance, room: number): Map<number, Prop> {
  const props = new Map<number, Prop>();
  readAll(module, "hairnet_get_props", room, kPropBytes, (view, at) => {
    const number = view.getUint32(at + 4, true);
    props.set(number, {
      number,
      shape: view.getUint32(at + 8, true),
      halfSizeM: tripleOf(view, at + 20),
      radiusM: view.getFloat32(at + 32, true),
      ...placeAt(view, at + 40),
      isInsideOut: view.getUint32(at + 12, true) !== 0,
      hasJumped: view.getUint32(at + 16, true) !== 0,
    });
  });
  return props;
}

/** Sessions, as the module takes them. */
export function sessionBytes(sessions: readonly bigint[]): Uint8Array {
  checkList(sessions, "setTouch", "chosen sessions");
  const view = new DataView(new ArrayBuffer(8 * sessions.length));
  for (const [i, session] of sessions.entries()) {
    if (typeof session !== "bigint") throw new HairnetError("invalid", "setTouch: a chosen session is no bigint");
    view.setBigUint64(8 * i, BigInt.asUintN(64, session), true);
  }
  return bytesOf(view);
}

/** Numbers of props, as the module takes them. */
export function numberBytes(numbers: readonly number[]): Uint8Array {
  checkList(numbers, "setProps", "removed numbers");
  for (const number of numbers) checkNumber(number, "setProps", "a removed number");
  return Uint8Array.from(numbers);
}

/** x y z, as the module takes them. */
export function placeBytes(place: Triple): Uint8Array {
  checkNumbers(place, 3, "takeHold", "place");
  return new Uint8Array(Float64Array.from(place).buffer);
}

/**
 * Calls `read` for each struct of `size` bytes that the function `name` of client/hairnet.h writes. Such a function
 * takes a buffer and its capacity, and returns how many structs there are.
 */
function readAll(
  module: Instance,
  name: string,
  room: number,
  size: number,
  read: (view: DataView, at: number) => void,
): void {
  const count = module.call(name, room, 0, 0);
  if (count === 0) return;
  const at = module.allocate(size * count);
  module.call(name, room, at, count);
  const view = module.view();
  for (let i = 0; i < count; ++i) read(view, at + size * i);
  module.call("free", at);
}

function placeAt(view: DataView, at: number): { readonly rotation: Quaternion; readonly position: Triple } {
  const number = (i: number) => view.getFloat64(at + 8 * i, true);
  return { rotation: [number(0), number(1), number(2), number(3)], position: [number(4), number(5), number(6)] };
}

function tripleOf(view: DataView, at: number): Triple {
  return [view.getFloat32(at, true), view.getFloat32(at + 4, true), view.getFloat32(at + 8, true)];
}

function putFloats(view: DataView, at: number, numbers: readonly number[]): void {
  for (const [i, number] of numbers.entries()) view.setFloat32(at + 4 * i, number, true);
}

function putDoubles(view: DataView, at: number, numbers: readonly number[]): void {
  for (const [i, number] of numbers.entries()) view.setFloat64(at + 8 * i, number, true);
}

function bytesOf(view: DataView<ArrayBuffer>): Uint8Array {
  return new Uint8Array(view.buffer);
}

/**
 * Throws `HairnetError` unless the number fits into a byte. The module itself checks the narrower limits: 32 shapes of
 * a person, and 128 props.
 */
export function checkNumber(number: number | undefined, call: string, what: string): void {
  if (!(Number.isInteger(number) && number! >= 0 && number! < 256))
    throw new HairnetError("invalid", `${call}: ${what} is ${String(number)}, no whole number from 0 to 255`);
}

function checkList(list: readonly unknown[], call: string, what: string): void {
  if (!Array.isArray(list)) throw new HairnetError("invalid", `${call}: the ${what} are a list`);
}

function checkNumbers(numbers: ArrayLike<number> | undefined, count: number, call: string, what: string): void {
  const isList = Array.isArray(numbers) || ArrayBuffer.isView(numbers);
  if (!isList || (numbers as ArrayLike<number>).length !== count)
    throw new HairnetError("invalid", `${call}: ${what} is not ${count} numbers`);
}
