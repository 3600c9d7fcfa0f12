import { materials, type MaterialScale, type WindOptions } from "../../src/index";

/** A look to try with one click: hair, wind, or both; what it leaves out stays. */
export interface Preset {
  readonly label: string;
  /** What the preset does, for a tooltip. */
  readonly about: string;
  readonly material?: MaterialScale;
  readonly wind?: WindOptions;
}

export const kPresets: readonly Preset[] = [
  { label: "Calm", about: "No wind, and hair as its maker made it.", material: materials.normal, wind: { speed: 0 } },
  { label: "Breeze", about: "A light wind with gusts.", wind: { speed: 2.5, gust: 0.6, turbulence: 0.4 } },
  { label: "Hurricane", about: "A strong and gusty wind.", wind: { speed: 14, gust: 0.5, turbulence: 3 } },
  {
    label: "Underwater",
    about: "Slow and floating: water carries the hair, resists it and drifts.",
    material: materials.underwater,
    wind: { speed: 0.35, gust: 1, turbulence: 0.3 },
  },
  { label: "Wet", about: "Heavy and limp, and quick to rest.", material: materials.wet },
  { label: "Gel", about: "Keeps its shape in motion and wind.", material: materials.gel },
];
