import { expect, test } from "vitest";
import { kPresets } from "../../../page/play/presets";
import { validateMessage } from "../../../src/net/clientMessages";
import { windOf } from "../../../src/room/wind";

test("a server takes every preset's material and wind", () => {
  for (const { material, wind } of kPresets) {
    if (wind) expect(() => validateMessage({ type: "setWind", wind: windOf(wind) })).not.toThrow();
    if (material) expect(() => validateMessage({ type: "setMaterial", character: 1, scale: material })).not.toThrow();
  }
});

test("each preset changes something, and Calm undoes them all", () => {
  for (const preset of kPresets) expect(preset.material ?? preset.wind).toBeDefined();
  const [calm] = kPresets;
  expect(windOf(calm.wind!).meanMPerS.map(Math.abs)).toEqual([0, 0, 0]);
  expect(Object.values(calm.material!)).toEqual([1, 1, 1, 1, 1, 0]);
});
