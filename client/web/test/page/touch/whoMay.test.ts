import { expect, test } from "vitest";
import { audienceOf, WhoMay } from "../../../page/touch/whoMay";
import { type OwnCharacter, TouchAudience } from "../../../src/index";

function begin(kept: string) {
  const told: string[] = [];
  const whoMay = new WhoMay(audienceOf(kept));
  const room = {
    setTouch: ({ character }: OwnCharacter, audience: TouchAudience) =>
      void told.push(`${character} ${TouchAudience[audience]}`),
  };
  return { whoMay, room, told };
}
const own = (character: number) => ({ character }) as OwnCharacter;

test("what was chosen before holds for each new character, and is told once", () => {
  const { whoMay, room, told } = begin("everyone");
  const first = own(1);
  whoMay.tell(null, null);
  whoMay.tell(room, null);
  whoMay.tell(room, first);
  whoMay.tell(room, first);
  expect(told).toEqual(["1 everyone"]);
  whoMay.tell(room, own(2));
  expect(told).toEqual(["1 everyone", "2 everyone"]);
});

test("the default needs no word, and a change back to it does", () => {
  const { whoMay, room, told } = begin("");
  const one = own(1);
  whoMay.tell(room, one);
  expect(told).toEqual([]);
  whoMay.audience = "nobody";
  whoMay.tell(room, one);
  whoMay.audience = "oneself";
  whoMay.tell(room, one);
  expect(told).toEqual(["1 nobody", "1 oneself"]);
});

test("words that nobody kept here mean the default", () => {
  for (const word of ["", "chosen", "anyone", "EVERYONE"]) expect(audienceOf(word)).toBe("oneself");
  for (const word of ["nobody", "oneself", "everyone"]) expect(audienceOf(word)).toBe(word);
});
