import { afterEach, describe, expect, test, vi } from "vitest";
import {
  PropShape,
  type Release,
  TouchAudience,
  type Hand,
  type Member,
  type OwnCharacter,
  type Prop,
} from "../../src/index";
import { client } from "../../src/module/client";
import { handsOf, propBytes, propsOf, sessionBytes, withHands } from "../../src/room/touch";
import { errorOf } from "../support/errorOf";
import { strandsFile } from "../support/grooms";
import { Person } from "../support/person";
import { Server } from "../support/server";
import { until } from "../support/until";
import { waitingRoom } from "../support/waitingRoom";

// What TypeScript would refuse, as JavaScript passes it.
const any = (value: unknown) => value as never;
/** A hand at (x, 1.6, 0), with a finger of 8 cm as shape `firstNumber`, and a ball of 4 cm as the next one. */
const hand = (x: number, firstNumber = 0): Hand => ({
  firstNumber,
  rotation: [0, 0, 0, 1],
  position: [x, 1.6, 0],
  shapes: [
    { from: [0, 0, 0], to: [0, 0.08, 0], radiusM: 0.01 },
    { from: [0, 0, 0], to: [0, 0, 0], radiusM: 0.04 },
  ],
});
const box: Prop = {
  number: 3,
  shape: PropShape.box,
  halfSizeM: [0.5, 0.5, 0.5],
  rotation: [0, 0, 0, 1],
  position: [0, 2, 0],
};
const me = { character: 1 } as OwnCharacter;
/** A member whom the room does not have. */
const nobody = { member: 3 } as Member;

afterEach(() => vi.restoreAllMocks());

describe("arguments", () => {
  test("that are no hands, holds or props are refused in a line", async () => {
    const room = await waitingRoom();
    for (const [call, pattern] of [
      [() => room.pushHands(any({})), /^pushHands: the hands are a list$/],
      [() => room.pushHands([any(null)]), /^pushHands: firstNumber is undefined/],
      [() => room.pushHands([{ ...hand(0), shapes: any(2) }]), /^pushHands: the shapes are a list$/],
      [() => room.pushHands([{ ...hand(0), rotation: any([0, 1]) }]), /^pushHands: rotation is not 4 numbers$/],
      [() => room.pushHands([{ ...hand(0), shapes: [any({})] }]), /^pushHands: an end of a shape is not 3 numbers$/],
      [() => room.takeHold(nobody, -1), /^takeHold: the number of the hand is -1/],
      [() => room.takeHold(nobody, 0), /^takeHold: [^\n]*no such member$/],
      [() => room.letGo(nobody, 0, 9 as Release), /^letGo: there is no release 9$/],
      [() => room.setTouch(me, 9 as TouchAudience), /^setTouch: there is no 9$/],
      [() => room.setTouch(me, TouchAudience.chosen, [any(5)]), /is no bigint$/],
      [() => room.setProps([{ ...box, number: 1.5 }]), /^setProps: the number of a prop is 1\.5/],
      [() => room.setProps([{ ...box, shape: 9 as PropShape }]), /^setProps: there is no shape 9$/],
      // Numbers of props are 0 to 127 (kPropsMax).
      [() => room.setProps([], [300]), /^setProps: a removed number is 300/],
    ] as const)
      expect(errorOf(call).message).toMatch(pattern);
    expect(room.counters.inputsDropped).toBe(0);
    room.close();
  });

  test("that are out of range are dropped, counted and reported, and the render loop goes on", async () => {
    const announced = vi.spyOn(console, "warn").mockImplementation(() => {});
    const room = await waitingRoom();
    // The same line three times is reported once. Props have numbers below 128.
    for (let i = 0; i < 3; ++i) room.pushHands([hand(NaN)]);
    room.setProps([{ ...box, number: 200 }]);
    expect(room.counters.inputsDropped).toBe(4);
    expect(announced.mock.calls.map(([line]) => line)).toEqual([
      expect.stringMatching(/^hairnet: pushHands: hand: [^\n]*place[^\n]*; it was dropped$/),
      expect.stringMatching(/^hairnet: setProps: [^\n]*128[^\n]*; it was dropped$/),
    ]);
    room.close();
  });
});

test("hands and props lie in memory as hairnet.h says", async () => {
  const room = await waitingRoom();
  const module = client();
  expect(handsOf(module, room.link.room).size).toBe(0);
  expect(propsOf(module, room.link.room).size).toBe(0);
  withHands(module, [hand(1), { ...hand(2, 7), hasJumped: true }], (at) => {
    const view = module.view();
    // A hairnet_hand has 80 bytes: position at 40, shapes at 64, their count at 68, first_number at 72, has_jumped at
    // 76.
    expect([view.getUint32(at + 68, true), view.getUint32(at + 72, true)]).toEqual([2, 0]);
    expect([view.getUint32(at + 148, true), view.getUint32(at + 152, true)]).toEqual([2, 7]);
    expect(view.getFloat64(at + 120, true)).toBe(2);
    expect(view.getUint32(at + 156, true)).toBe(1);
    const second = view.getUint32(at + 144, true);
    // The shapes of both hands lie one behind the other: two of 32 bytes each before those of the second hand.
    expect(second).toBe(view.getUint32(at + 64, true) + 64);
    expect(view.getFloat32(second + 16, true)).toBeCloseTo(0.08);
  });
  // A hairnet_touch_body has 96 bytes.
  expect(propBytes([box, box])).toHaveLength(192);
  // 258 is 2 + 256: the lowest byte comes first.
  expect([...sessionBytes([258n])]).toEqual([2, 1, 0, 0, 0, 0, 0, 0]);
  room.close();
});

test("a hand that may touch takes hold of another's hair, and others see it", async () => {
  const server = new Server(["--props-from-clients", "everyone"]);
  await server.start();
  const ann = await Person.join(server.address);
  ann.own = ann.room.addCharacter(await strandsFile(200, 8), { tag: "Ann" });
  // Her head rests, so that his hand stays at her hair.
  ann.moves = false;
  const ben = await Person.join(server.address);
  const seen = await ben.meets("Ann");
  expect(ben.room.mayTouch(seen)).toBe(false);
  ann.room.setTouch(ann.own, TouchAudience.chosen, [ben.room.session]);
  await until("he may", () => ben.room.mayTouch(seen));

  const held: number[] = [];
  ben.room.on("held", ({ member, pointCount }) => member === seen && held.push(pointCount));
  // A server forgets a hand half a second after its last message, so it is sent all the time.
  const reaching = setInterval(() => ben.room.pushHands([hand(0)]), 10);
  await until("her hair is held", () => {
    if (held.at(-1)) return true;
    // Shape 1 is the ball, at her head joint. It takes all hair within 0.3 m of its middle, the most that is allowed.
    ben.room.takeHold(seen, 1, [0, 0, 0], 0.3);
    return false;
  });
  await until("she sees his hand", () => ann.room.hands.get(ben.room.session)?.[0].shapes.length === 2);
  ann.room.setTouch(ann.own, TouchAudience.nobody);
  await until("he has lost it", () => held.at(-1) === 0);
  clearInterval(reaching);
  await until("his hand is gone", () => ann.room.hands.size === 0);

  expect(ben.room.maySetProps).toBe(true);
  ben.room.setProps([box]);
  await until("she sees the prop", () => ann.room.props.get(3)?.halfSizeM?.[1] === 0.5);
  ben.room.setProps([], [3]);
  await until("it is gone", () => ann.room.props.size === 0);
  for (const person of [ann, ben]) person.leave();
  await server.dispose();
});
