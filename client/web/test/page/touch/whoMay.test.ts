import { expect, test } from "vitest";
import { audienceOf, WhoMay } from "../../../page/touch/whoMay";
import { type OwnCharacter, TouchAudience } from "../../../src/index";

function begin(kept: string) {
  const announced: string[] = [];
  const whoMay = new WhoMay(audienceOf(kept));
  const room = {
    setTouch: ({ character }: OwnCharacter, audience: TouchAudience) =>
      void announced.push(`${character} ${TouchAudience[audience]}`),
  };
  return { whoMay, room, announced };
}
const own = (character: number) => ({ character }) as OwnCharacter;

test("what was chosen before holds for each new character, and is told once", () => {
  const { whoMay, room, announced } = begin("everyone");
  const first = own(1);
  whoMay.tell(null, null);
  whoMay.tell(room, null);
  whoMay.tell(room, first);
  whoMay.tell(room, first);
  expect(announced).toEqual(["1 everyone"]);
  whoMay.tell(room, own(2));
  expect(announced).toEqual(["1 everyone", "2 everyone"]);
});

test("the default needs no word, and a change back to it does", () => {
  const { whoMay, room, announced } = begin("");
  const one = own(1);
  whoMay.tell(room, one);
  // A server's own default is "oneself", so there is nothing to announce.
  expect(announced).toEqual([]);
  whoMay.audience = "nobody";
  whoMay.tell(room, one);
  whoMay.audience = "oneself";
  whoMay.tell(room, one);
  expect(announced).toEqual(["1 nobody", "1 oneself"]);
});

test("words that nobody kept here mean the default", () => {
  for (const word of ["", "chosen", "anyone", "EVERYONE"]) expect(audienceOf(word)).toBe("oneself");
  for (const word of ["nobody", "oneself", "everyone"]) expect(audienceOf(word)).toBe(word);
});
