import { checkOptions } from "../hair/checkOptions";
import { HairnetError } from "../module/hairnetError";

/** The air in a room; `hairnet_wind` of client/hairnet.h. */
export interface Wind {
  /** The mean velocity of the air, world. */
  readonly meanMPerS: readonly [number, number, number];
  /** Gusts vary the speed between (1 - ratio) and (1 + ratio) times its mean; 0 to 1. */
  readonly gustRatio: number;
  /** The period of the slowest gust. */
  readonly gustPeriodS: number;
  /** The root mean square of each component of the turbulent velocity. */
  readonly turbulenceRmsMPerS: number;
  /** The smallest length over which turbulence changes; at least 0.3. */
  readonly turbulenceScaleM: number;
  /** Winds of different seeds have different gusts and eddies. */
  readonly seed: bigint;
  /** True: the air goes along with each head, as in a vehicle. False: it stands in the room. */
  readonly carried: boolean;
}

/** A wind in few words. */
export interface WindOptions {
  /** The speed, m/s; 0: still air. */
  readonly speed?: number;
  /**
   * Where the wind comes from, degrees about +Y: 0 is from +Z, into the face of a head at rest, and 90 from +X. By
   * default it is 90.
   */
  readonly from?: number;
  /** Gusts vary the speed between (1 - gust) and (1 + gust) times its mean; 0 to 1, by default 0.4. */
  readonly gust?: number;
  /** The root mean square of each component of the turbulent velocity, m/s; by default 0.15 times the speed. */
  readonly turbulence?: number;
  /** True: the air goes along with each head, as in a vehicle. By default it stands in the room. */
  readonly carried?: boolean;
}

// The names of `WindOptions`, by which `windOf` tells them from a `Wind`. Both have `carried`.
const kShort: Readonly<Record<Exclude<keyof WindOptions, "carried">, true>> = {
  speed: true,
  from: true,
  gust: true,
  turbulence: true,
};
/** The size of hairnet_wind of client/hairnet.h. */
export const kWindBytes = 72;
/** The defaults of `WindOptions.from`, degrees, and of `WindOptions.gust`. */
const kFrom = 90;
const kGust = 0.4;
// The default of `WindOptions.turbulence` over the speed: a usual intensity of turbulence outdoors.
const kTurbulenceIntensity = 0.15;

/** Still air, which also has the defaults of every property of a `Wind`. */
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
  if (full) return wholeWind(options as Partial<Wind>);
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

/** A `Wind` of some of its properties; the others are those of still air. */
function wholeWind(options: Partial<Wind>): Wind {
  const wind = { ...kStillAir, ...options };
  const mean: unknown = wind.meanMPerS;
  if (!(Array.isArray(mean) || ArrayBuffer.isView(mean)) || (mean as number[]).length !== 3)
    throw new HairnetError("invalid", "setWind: meanMPerS is not 3 numbers");
  if (typeof wind.seed !== "bigint") throw new HairnetError("invalid", "setWind: seed is no bigint");
  return wind;
}

const kNumbers = ["gustRatio", "gustPeriodS", "turbulenceRmsMPerS", "turbulenceScaleM"] as const;

/** The bytes of a hairnet_wind (client/hairnet.h). */
export function windBytes(wind: Wind): Uint8Array {
  const view = new DataView(new ArrayBuffer(kWindBytes));
  const numbers = [...wind.meanMPerS, ...kNumbers.map((name) => wind[name])];
  for (const [i, number] of numbers.entries()) view.setFloat64(8 * i, number, true);
  view.setBigUint64(56, BigInt.asUintN(64, wind.seed), true);
  view.setUint32(64, Number(wind.carried), true);
  return new Uint8Array(view.buffer);
}

/** The wind of a hairnet_wind's bytes. */
export function windFrom(view: DataView): Wind {
  const number = (i: number) => view.getFloat64(8 * i, true);
  return {
    meanMPerS: [number(0), number(1), number(2)],
    gustRatio: number(3),
    gustPeriodS: number(4),
    turbulenceRmsMPerS: number(5),
    turbulenceScaleM: number(6),
    seed: view.getBigUint64(56, true),
    carried: view.getUint32(64, true) !== 0,
  };
}
