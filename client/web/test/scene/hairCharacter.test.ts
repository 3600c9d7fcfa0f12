import { expect, test } from "vitest";
import { defaultAppearance } from "../../src/hair/appearance";
import { HairCharacter } from "../../src/scene/hairCharacter";

const kRed = { hairRoot: 0x9e5930, hairTip: 0xb07040, skin: 0xe0c0b0, roughness: 0.5 };

// 3 is the member's number, by which everyone chooses the same default colours (`defaultAppearance`).
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
  // A tip of the root's colour is no colour of its own.
  character.follow({ ...kRed, hairTip: kRed.hairRoot });
  expect(character.hairTipColour).toBeNull();
});

test("keeps a program's colours until its owner changes them, or for good", () => {
  const character = new HairCharacter(3, false, "groom");
  // A scene calls `follow` for every picture. The same object means that the owner has changed nothing since, so the
  // colour of the program stays. Another object, though equal, is a change by the owner.
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
