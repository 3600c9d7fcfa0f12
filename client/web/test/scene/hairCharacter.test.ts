import { expect, test } from "vitest";
import { defaultAppearance } from "../../src/hair/appearance";
import { HairCharacter } from "../../src/scene/hairCharacter";

const kRed = { hairRoot: 0x9e5930, hairTip: 0xb07040, skin: 0xe0c0b0, roughness: 0.5 };

test("has the default appearance of its number, then its member's, then the newest", () => {
  const character = new HairCharacter(3, false, "groom");
  expect(character.hairColour.getHex()).toBe(defaultAppearance(3).hairRoot);
  expect(character.hairTipColour).toBeNull();
  character.follow(undefined);
  expect(character.hairColour.getHex()).toBe(defaultAppearance(3).hairRoot);
  character.follow(kRed);
  expect(character.hairColour.getHex()).toBe(0x9e5930);
  expect(character.hairTipColour?.getHex()).toBe(0xb07040);
  expect(character.skinColour.getHex()).toBe(0xe0c0b0);
  expect(character.roughness).toBe(0.5);
  character.follow({ ...kRed, hairTip: kRed.hairRoot });
  expect(character.hairTipColour).toBeNull();
});

test("keeps a program's colours until its owner changes them, or for good", () => {
  const character = new HairCharacter(3, false, "groom");
  character.follow(kRed);
  character.hairColour.setHex(0x112233);
  character.follow(kRed);
  expect(character.hairColour.getHex()).toBe(0x112233);
  character.follow({ ...kRed });
  expect(character.hairColour.getHex()).toBe(0x9e5930);
  character.followsMember = false;
  character.hairColour.setHex(0x112233);
  character.follow({ ...kRed, hairRoot: 0 });
  expect(character.hairColour.getHex()).toBe(0x112233);
});
