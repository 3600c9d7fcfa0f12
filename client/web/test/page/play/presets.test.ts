import { expect, test } from "vitest";
import { kPresets } from "../../../page/play/presets";
import { windOf } from "../../../src/room/wind";
import { strandsFile } from "../../support/grooms";
import { waitingRoom } from "../../support/waitingRoom";

test("every preset's material and wind is one that a room takes", async () => {
  const room = await waitingRoom();
  const me = room.addCharacter(await strandsFile(20, 6));
  for (const { material, wind } of kPresets) {
    if (wind) room.setWind(wind);
    if (material) me.setMaterial(material);
  }
  expect(room.counters.inputsDropped).toBe(0);
  room.close();
});

test("each preset changes something, and Calm undoes them all", () => {
  for (const preset of kPresets) expect(preset.material ?? preset.wind).toBeDefined();
  const [calm] = kPresets;
  expect(windOf(calm.wind!).meanMPerS.map(Math.abs)).toEqual([0, 0, 0]);
  // The values of a normal material: factors of 1, and no gel (`materials.normal`).
  expect(Object.values(calm.material!)).toEqual([1, 1, 1, 1, 1, 0]);
});
