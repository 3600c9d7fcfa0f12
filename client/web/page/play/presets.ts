import type { MaterialScale, Wind } from "../../src/index";

/** A look to try with one click: hair, wind, or both; what it leaves out stays. */
export interface Preset {
  readonly label: string;
  /** what it does, for a tooltip */
  readonly about: string;
  readonly material?: MaterialScale;
  /** speed, m/s; gusts as a share of it; turbulence, m/s */
  readonly wind?: { readonly speed: number; readonly gust: number; readonly turbulence: number };
}

const kNormal: MaterialScale = { stiffness: 1, damping: 1, density: 1, etherDamping: 1, airDrag: 1, gelPerS2: 0 };
const kCalm = { speed: 0, gust: 0, turbulence: 0 };

export const kPresets: readonly Preset[] = [
  { label: "Calm", about: "No wind, and hair as its maker made it.", material: kNormal, wind: kCalm },
  { label: "Breeze", about: "A light wind with gusts.", wind: { speed: 2.5, gust: 0.6, turbulence: 0.4 } },
  { label: "Hurricane", about: "A strong and gusty wind.", wind: { speed: 14, gust: 0.5, turbulence: 3 } },
  {
    label: "Underwater",
    about: "Slow and floating: water resists much more than air, and drifts.",
    material: { ...kNormal, stiffness: 0.3, etherDamping: 6, airDrag: 15, density: 2 },
    wind: { speed: 0.35, gust: 1, turbulence: 0.3 },
  },
  {
    label: "Wet",
    about: "Heavy and limp, and quick to rest.",
    material: { ...kNormal, stiffness: 0.5, damping: 3, density: 2.5, etherDamping: 3, airDrag: 0.4 },
  },
  {
    label: "Gel",
    about: "Keeps its shape in motion and wind.",
    material: { ...kNormal, stiffness: 2, etherDamping: 2, gelPerS2: 900 },
  },
];

/** The preset's wind from a bearing, degrees about +Y from +Z; null: the preset leaves the wind as it is. */
export function windOf(preset: Preset, fromDeg: number): Wind | null {
  if (!preset.wind) return null;
  const { speed, gust, turbulence } = preset.wind;
  const from = (fromDeg * Math.PI) / 180;
  return {
    meanMPerS: [-speed * Math.sin(from), 0, -speed * Math.cos(from)],
    gustRatio: gust,
    gustPeriodS: 4,
    turbulenceRmsMPerS: turbulence,
    turbulenceScaleM: 0.6,
    seed: 1n,
  };
}
