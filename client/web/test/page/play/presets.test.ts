import { expect, test } from "vitest";
import { kPresets, windOf } from "../../../page/play/presets";
import { validateMessage } from "../../../src/net/clientMessages";

test("a server takes every preset's material and wind", () => {
  for (const preset of kPresets) {
    const wind = windOf(preset, 90);
    if (wind) {
      expect(() => validateMessage({ type: "setWind", wind })).not.toThrow();
      expect(wind.meanMPerS[0]).toBeCloseTo(-preset.wind!.speed);
    }
    if (preset.material) {
      const { material } = preset;
      expect(() => validateMessage({ type: "setMaterial", character: 1, scale: material })).not.toThrow();
    }
  }
});

test("each preset changes something, and Calm undoes them all", () => {
  for (const preset of kPresets) expect(preset.material ?? preset.wind).toBeDefined();
  const [calm] = kPresets;
  expect(windOf(calm, 90)!.meanMPerS.map(Math.abs)).toEqual([0, 0, 0]);
  expect(Object.values(calm.material!)).toEqual([1, 1, 1, 1, 1, 0]);
});
