import { PerspectiveCamera, Ray, Scene, Vector3 } from "three";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import type { Shown } from "../../../page/focus";
import { Touching, type TouchHost } from "../../../page/touching";
import type { Room } from "../../../src/index";
import { FakeRoom } from "./fakeRoom";
import { personAt } from "./people";

/**
 * Values of clientX whose ray meets the hair of the person, and misses it: `rayAt` below looks at z = clientX / 100, m.
 */
const kHair = 1;
const kBeside = 900;
const eye = new Vector3(3, 1.6, 0);

/** A room as the page has it; `report` does what an event of the server does. */
class FakeServed extends FakeRoom {
  readonly hands = new Map();
  readonly #listeners = new Map<string, (event: unknown) => void>();

  on(event: string, listener: (event: unknown) => void): void {
    this.#listeners.set(event, listener);
  }

  report(event: string, about: unknown): void {
    this.#listeners.get(event)?.(about);
  }
}

/**
 * A page with one person at the origin. `scale`: of the drawn head; `untouchable`: a member whom the user may not
 * touch.
 */
function makePage({ observes = false, scale = 1, untouchable = -1 } = {}) {
  const person = { ...personAt(1, [0, 1.6, 0]), own: true };
  const room = new FakeServed([person], untouchable);
  const captured: number[] = [];
  const canvas = Object.assign(new EventTarget(), { setPointerCapture: (id: number) => captured.push(id) });
  const orbit = { enabled: true };
  const stage = {
    canvas,
    orbit,
    scene: new Scene(),
    camera: new PerspectiveCamera(),
    radPerPx: 0.002,
    renderer: { xr: { isPresenting: false } },
    rayAt: ({ clientX }: { clientX: number }) => new Ray(eye, new Vector3(0, 1.6, clientX / 100).sub(eye).normalize()),
  };
  const hint = { hidden: true };
  const host = { stage, query: { observe: observes, local: false }, own: null, served: room as unknown as Room };
  const touching = new Touching(host as unknown as TouchHost, hint as HTMLElement);
  touching.enter(host.served);
  const shown = [{ member: person, character: { scale: new Vector3(scale, scale, scale) } }] as unknown as Shown[];
  const send = (type: string, about: Partial<PointerEvent> = {}) => {
    const usual = { pointerId: 7, button: 0, isPrimary: true, pointerType: "mouse", clientX: kHair, clientY: 0 };
    canvas.dispatchEvent(Object.assign(new Event(type), usual, about));
  };
  return { room, orbit, captured, hint, touching, send, draw: () => touching.update(shown) };
}

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

test("a press on hair takes hold of it and keeps the camera still; releasing lets go and frees the camera", () => {
  const { room, orbit, captured, touching, send, draw } = makePage();
  send("pointerdown");
  expect(touching.isPressed).toBe(true);
  expect(room.calls).toEqual(["hands 1", "take 1 0"]);
  // The pointer is captured, so that the page hears of a release outside of the canvas.
  expect(captured).toEqual([7]);
  expect(orbit.enabled).toBe(false);
  // Another pointer is released, which does not concern this press.
  send("pointerup", { pointerId: 8 });
  expect(touching.isPressed).toBe(true);
  send("pointerup");
  expect(touching.isPressed).toBe(false);
  expect(orbit.enabled).toBe(true);
  expect(room.calls.at(-1)).toBe("let go 1 0 drop");
  draw();
  draw();
  // After a hand has gone one empty message says so, and no further one.
  expect(room.calls.slice(3)).toEqual(["hands 0"]);
});

test("a press that the browser takes away, for a gesture of its own, lets go too", () => {
  const { room, orbit, touching, send } = makePage();
  send("pointerdown", { pointerType: "touch" });
  send("pointercancel");
  expect(touching.isPressed).toBe(false);
  expect(orbit.enabled).toBe(true);
  expect(room.calls.at(-1)).toBe("let go 1 0 drop");
});

test("a camera that was held before stays so", () => {
  const { orbit, send } = makePage();
  orbit.enabled = false;
  send("pointerdown");
  send("pointerup");
  expect(orbit.enabled).toBe(false);
});

test.each([
  ["beside hair", {}, { clientX: kBeside }],
  ["with another button", {}, { button: 2 }],
  ["on hair that the user may not touch", { untouchable: 1 }, {}],
  ["by an observer", { observes: true }, {}],
])("a press %s is the camera's", (_, page, press) => {
  const { room, orbit, captured, touching, send } = makePage(page);
  send("pointerdown", press);
  expect(touching.isPressed).toBe(false);
  expect(orbit.enabled).toBe(true);
  expect(captured).toEqual([]);
  expect(room.calls).toEqual([]);
});

test("a second finger pins the hair that the first one lets go", () => {
  const { room, touching, send } = makePage();
  send("pointerdown", { pointerType: "touch" });
  send("pointerdown", { pointerType: "touch", pointerId: 9, isPrimary: false });
  send("pointerup", { pointerType: "touch" });
  expect(room.calls.at(-1)).toBe("let go 1 0 pin");
  expect(touching.hasPinned).toBe(true);
  touching.unpin();
  expect(room.calls.at(-1)).toBe("let go 1 0 unpin");
});

test("a hand that holds is sent while no picture is drawn, or it would be gone", () => {
  const { room, send } = makePage();
  send("pointerdown");
  vi.advanceTimersByTime(1000);
  // A server forgets hands half a second after they were last sent (hairnet_push_hands).
  expect(room.calls.filter((call) => call === "hands 1").length).toBeGreaterThan(5);
  send("pointerup");
  const { length } = room.calls;
  vi.advanceTimersByTime(1000);
  expect(room.calls).toHaveLength(length);
});

test("a lost connection ends the press", () => {
  const { room, touching, send } = makePage();
  send("pointerdown");
  room.report("state", { state: "reconnecting" });
  expect(touching.isPressed).toBe(false);
  const { length } = room.calls;
  send("pointerup");
  expect(room.calls).toHaveLength(length);
});

test("the hint is there until the user touches hair, and only where there is some to touch", () => {
  const page = makePage();
  page.draw();
  expect(page.hint.hidden).toBe(false);
  page.send("pointerdown");
  page.send("pointerup");
  page.draw();
  expect(page.hint.hidden).toBe(true);
  for (const other of [makePage({ untouchable: 1 }), makePage({ observes: true })]) {
    other.draw();
    expect(other.hint.hidden).toBe(true);
  }
});

test("an own head that is drawn in another size is not touched: hair in the room is elsewhere", () => {
  // The avatar makes the head 1.2 times as large in this page alone.
  const { room, hint, touching, send, draw } = makePage({ scale: 1.2 });
  draw();
  expect(hint.hidden).toBe(true);
  send("pointerdown");
  expect(touching.isPressed).toBe(false);
  expect(room.calls).toEqual([]);
});
