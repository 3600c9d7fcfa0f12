import type { MaterialScale, Wind, WindOptions } from "../src/index";

/** What a slider shows. `least` and `most` are its ends, in the unit of its value. */
interface Slider {
  readonly label: string;
  /** One line that says what the slider does. */
  readonly note: string;
  readonly least: number;
  readonly most: number;
  readonly start: number;
  /** The scale is logarithmic: most useful values are near 1, and factors of 2 and 1/2 are equally far from it. */
  readonly isLogarithmic?: boolean;
  /** Writes a value with its unit. */
  readonly words: (value: number) => string;
}

const times = (value: number) => `× ${value < 1 ? value.toFixed(2) : value.toFixed(1)}`;
/** A moving slider, which has many more events than a server needs, tells its values no more often than this. */
const kTellEveryMs = 120;
/** The sliders of factors, which start at 1: the hair as its maker made it. */
const kScale = { isLogarithmic: true, start: 1, words: times };

// The ends lie within those of servers (`MaterialScale` of src/room/materials.ts): factors from 0.01 to 100, and gel up
// to 10 000 per square second.
const kMaterial: Record<keyof MaterialScale, Slider> = {
  stiffness: { label: "Stiffness", note: "How strongly hair keeps its shape.", least: 0.05, most: 20, ...kScale },
  damping: { label: "Damping", note: "How soon a swinging lock stops.", least: 0.05, most: 20, ...kScale },
  density: {
    label: "Density",
    note: "The weight of the hair: heavy hair swings slowly.",
    least: 0.1,
    most: 10,
    ...kScale,
  },
  etherDamping: {
    label: "Calm",
    note: "How soon the whole hairstyle stops moving about the head.",
    least: 0.05,
    most: 20,
    ...kScale,
  },
  airDrag: {
    label: "Air drag",
    note: "How strongly air and wind take hold of the hair.",
    least: 0.05,
    most: 20,
    ...kScale,
  },
  gelPerS2: {
    label: "Gel",
    note: "How strongly gel pulls hair back to its resting shape.",
    least: 0,
    most: 2000,
    start: 0,
    words: (value) => (value < 1 ? "none" : `${value.toFixed(0)} /s²`),
  },
};
/** The wind in the words of `WindOptions` (src/room/wind.ts), where `bearing` is `from`. */
const kWind = {
  speed: {
    label: "Wind",
    note: "Everyone in the room feels it.",
    least: 0,
    most: 20,
    start: 0,
    words: (value: number) => (value < 0.05 ? "calm" : `${value.toFixed(1)} m/s`),
  },
  bearing: {
    label: "Wind from",
    note: "The direction that it comes from, seen from the front.",
    least: -180,
    most: 180,
    start: 90,
    words: bearingWords,
  },
  gust: {
    label: "Gusts",
    note: "The share of the speed that comes and goes, every 4 s.",
    least: 0,
    most: 1,
    start: 0.4,
    words: (value: number) => `${(100 * value).toFixed(0)} %`,
  },
  turbulence: {
    label: "Turbulence",
    note: "Small eddies in the wind.",
    least: 0,
    most: 4,
    start: 0.5,
    words: (value: number) => `${value.toFixed(1)} m/s`,
  },
} satisfies Record<string, Slider>;

/** The bearing that a wind comes from, -180 to 180 degrees, in words: 0 is the front, 90 the right of the picture. */
function bearingWords(value: number): string {
  const names = [
    "behind",
    "behind left",
    "the left",
    "front left",
    "the front",
    "front right",
    "the right",
    "behind right",
  ];
  const name = names[((Math.round((value + 180) / 45) % 8) + 8) % 8];
  return `${name}, ${value.toFixed(0)}°`;
}

/** Sliders of the user's own hair and of the room's wind. */
export class Sliders {
  readonly #material: SliderGroup<keyof MaterialScale>;
  readonly #wind: SliderGroup<keyof typeof kWind>;

  constructor(
    hair: HTMLElement,
    air: HTMLElement,
    onMaterial: (scale: MaterialScale) => void,
    onWind: (wind: WindOptions) => void,
  ) {
    this.#material = new SliderGroup(hair, kMaterial, "Reset hair", () => onMaterial(this.material));
    this.#wind = new SliderGroup(air, kWind, "Reset wind", () => onWind(this.#readWind()));
  }

  get material(): MaterialScale {
    return this.#material.values;
  }

  /** Shows values that something else has set. */
  set material(scale: MaterialScale) {
    this.#material.show(scale);
  }

  /** Shows the wind that blows in the room, except while the user moves a slider of it. */
  showWind({ meanMPerS: [x, , z], gustRatio, turbulenceRmsMPerS }: Wind): void {
    const speed = Math.hypot(x, z);
    // Without wind its direction and turbulence mean nothing: the sliders keep what the user wants.
    const { bearing, turbulence } = this.#wind.values;
    this.#wind.show({
      speed,
      bearing: speed > 0 ? (Math.atan2(-x, -z) * 180) / Math.PI : bearing,
      gust: gustRatio,
      turbulence: speed > 0 ? turbulenceRmsMPerS : turbulence,
    });
  }

  #readWind(): WindOptions {
    const { speed, bearing, gust, turbulence } = this.#wind.values;
    return { speed, from: bearing, gust, turbulence: speed > 0 ? turbulence : 0 };
  }
}

/** Sliders with their values, and a button that resets them. */
class SliderGroup<Name extends string> {
  readonly #sliders: Record<Name, Slider>;
  readonly #rows = new Map<Name, { input: HTMLInputElement; output: HTMLElement }>();
  /** The user has made a change that has not been announced yet, and `show` must not undo it. */
  #isWaiting = false;

  constructor(place: HTMLElement, sliders: Record<Name, Slider>, resetLabel: string, onInput: () => void) {
    this.#sliders = sliders;
    for (const name of Object.keys(sliders) as Name[]) this.#addRow(place, name, () => this.#tell(onInput));
    const reset = document.createElement("button");
    reset.type = "button";
    reset.className = "reset";
    reset.textContent = resetLabel;
    reset.addEventListener("click", () => {
      for (const name of this.#rows.keys()) this.#put(name, sliders[name].start);
      onInput();
    });
    place.append(reset);
  }

  get values(): Record<Name, number> {
    const read = [...this.#rows].map(([name, { input }]) => [name, valueAt(this.#sliders[name], Number(input.value))]);
    return Object.fromEntries(read) as Record<Name, number>;
  }

  /** Moves the sliders to these values, but for a slider that the user is moving. */
  show(values: Readonly<Record<Name, number>>): void {
    if (this.#isWaiting) return;
    for (const [name, { input }] of this.#rows) if (!input.matches(":active")) this.#put(name, values[name]);
  }

  #addRow(place: HTMLElement, name: Name, onInput: () => void): void {
    const slider = this.#sliders[name];
    const row = document.createElement("label");
    row.className = "slider";
    row.title = slider.note;
    const label = document.createElement("span");
    label.textContent = slider.label;
    const output = document.createElement("output");
    const input = document.createElement("input");
    // The input counts from 0 at the left end to 1 at the right end (`placeOf`). Its step is a 200th of the way.
    input.type = "range";
    input.name = name;
    input.min = "0";
    input.max = "1";
    input.step = "0.005";
    const note = document.createElement("small");
    note.textContent = slider.note;
    note.id = `${name}-note`;
    input.setAttribute("aria-label", slider.label);
    input.setAttribute("aria-describedby", note.id);
    input.addEventListener("input", () => {
      this.#showValue(name);
      onInput();
    });
    row.append(label, output, input, note);
    place.append(row);
    this.#rows.set(name, { input, output });
    this.#put(name, slider.start);
  }

  // Calls `onInput` at most once in kTellEveryMs, with the newest values.
  #tell(onInput: () => void): void {
    if (this.#isWaiting) return;
    this.#isWaiting = true;
    setTimeout(() => {
      this.#isWaiting = false;
      onInput();
    }, kTellEveryMs);
  }

  #put(name: Name, value: number): void {
    const row = this.#rows.get(name);
    const at = String(placeOf(this.#sliders[name], value));
    if (!row || row.input.value === at) return this.#showValue(name);
    row.input.value = at;
    this.#showValue(name);
  }

  #showValue(name: Name): void {
    const { input, output } = this.#rows.get(name)!;
    const words = this.#sliders[name].words(valueAt(this.#sliders[name], Number(input.value)));
    output.textContent = words;
    input.setAttribute("aria-valuetext", words);
  }
}

/** The value of a slider whose thumb is at `at`, from 0 at its left end to 1 at its right end. */
function valueAt({ isLogarithmic, least, most }: Slider, at: number): number {
  return isLogarithmic ? least * (most / least) ** at : least + at * (most - least);
}

/** Where the thumb is for a value, 0 to 1: the inverse of `valueAt`. */
function placeOf({ isLogarithmic, least, most }: Slider, value: number): number {
  const within = Math.min(Math.max(value, least), most);
  return isLogarithmic ? Math.log(within / least) / Math.log(most / least) : (within - least) / (most - least);
}
