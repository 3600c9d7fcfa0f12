import { expect, test } from "vitest";
import { watchInputMeans } from "../../page/inputMeans";

/** A device, and whether hints of mouse and keys are hidden on it. */
function device(hasMouse: boolean) {
  const classes = new Set<string>();
  const classList = { toggle: (name: string, on: boolean) => (on ? classes.add(name) : classes.delete(name)) };
  const media = Object.assign(new EventTarget(), { matches: hasMouse });
  const keys = new EventTarget();
  watchInputMeans({ classList } as never, media as never, keys as never);
  return {
    isTouchOnly: () => classes.has("touch-only"),
    press: (key: string) => keys.dispatchEvent(Object.assign(new Event("keydown"), { key })),
    plugIn: (matches: boolean) => {
      media.matches = matches;
      media.dispatchEvent(new Event("change"));
    },
  };
}

test("a phone shows no hints of keys, also while its user types a name, until a keyboard is used", () => {
  const phone = device(false);
  expect(phone.isTouchOnly()).toBe(true);
  // Keyboards on a screen send letters, or "Unidentified" in place of them. No such keyboard has arrow keys.
  for (const key of ["a", "Unidentified", "Backspace", "Enter"]) phone.press(key);
  expect(phone.isTouchOnly()).toBe(true);
  phone.press("ArrowLeft");
  expect(phone.isTouchOnly()).toBe(false);
});

test("a device with a mouse shows them, as long as it has it", () => {
  const tablet = device(true);
  expect(tablet.isTouchOnly()).toBe(false);
  tablet.plugIn(false);
  expect(tablet.isTouchOnly()).toBe(true);
  tablet.plugIn(true);
  expect(tablet.isTouchOnly()).toBe(false);
});
