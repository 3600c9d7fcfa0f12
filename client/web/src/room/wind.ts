import { checkOptions } from "../hair/checkOptions";
import { HairnetError } from "../hair/hairnetError";
import type { Wind } from "../net/messages";

/** A wind in few words. */
export interface WindOptions {
  /** m/s; 0: still air */
  readonly speed?: number;
  /** where the wind comes from, degrees about +Y: 0 from +Z, into the face of a head at rest; 90 from +X; 90 by default */
  readonly from?: number;
  /** gusts vary the speed between (1 - gust) and (1 + gust) times its mean; 0 to 1, 0.4 by default */
  readonly gust?: number;
  /** of each component of the velocity, root mean square, m/s; 0.15 times the speed by default */
  readonly turbulence?: number;
  /** the air goes along with each head, as in a vehicle; false by default: it stands in the room */
  readonly carried?: boolean;
}

// `carried` is a property of both.
const kShort: Readonly<Record<Exclude<keyof WindOptions, "carried">, true>> = {
  speed: true,
  from: true,
  gust: true,
  turbulence: true,
};
const kFrom = 90;
const kGust = 0.4;
const kTurbulenceIntensity = 0.15; // usual outdoors

export const kStillAir: Wind = {
  meanMPerS: [0, 0, 0],
  gustRatio: 0,
  gustPeriodS: 4,
  turbulenceRmsMPerS: 0,
  turbulenceScaleM: 0.6,
  seed: 1n,
  carried: false,
};

/** The wind of these options, or of some of a `Wind`'s own properties; what is absent gets its default. */
export function windOf(options: WindOptions | Partial<Wind>): Wind {
  checkOptions<WindOptions & Partial<Wind>>(options, { ...kShort, ...kStillAir }, "setWind");
  const full = Object.keys(options).find((name) => name !== "carried" && Object.hasOwn(kStillAir, name));
  const short = Object.keys(options).find((name) => Object.hasOwn(kShort, name));
  if (full && short) throw new HairnetError("invalid", `setWind: give either '${short}' or '${full}', not both`);
  if (full) return { ...kStillAir, ...options };
  const {
    speed = 0,
    from = kFrom,
    gust = kGust,
    turbulence = kTurbulenceIntensity * speed,
    carried = false,
  } = options as WindOptions;
  for (const [name, value] of Object.entries({ speed, from, gust, turbulence }))
    if (!Number.isFinite(value)) throw new HairnetError("invalid", `setWind: ${name} is not a number`);
  if (speed < 0) throw new HairnetError("invalid", "setWind: speed is negative; turn the wind by 'from'");
  const angle = (from * Math.PI) / 180;
  return {
    ...kStillAir,
    meanMPerS: [-speed * Math.sin(angle), 0, -speed * Math.cos(angle)],
    gustRatio: gust,
    turbulenceRmsMPerS: turbulence,
    carried,
  };
}
