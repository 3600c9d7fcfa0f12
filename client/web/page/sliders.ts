import type { MaterialScale, Wind } from "../src/index";

interface Slider {
  readonly label: string;
  readonly least: number;
  readonly most: number;
  readonly start: number;
  /** of the slider's scale: most useful values are near 1 */
  readonly isLogarithmic?: boolean;
}

const kMaterial: Record<keyof MaterialScale, Slider> = {
  stiffness: { label: "Stiffness", least: 0.05, most: 20, start: 1, isLogarithmic: true },
  damping: { label: "Damping", least: 0.05, most: 20, start: 1, isLogarithmic: true },
  density: { label: "Density", least: 0.1, most: 10, start: 1, isLogarithmic: true },
  etherDamping: { label: "Calm", least: 0.05, most: 20, start: 1, isLogarithmic: true },
  airDrag: { label: "Air drag", least: 0.05, most: 20, start: 1, isLogarithmic: true },
  gelPerS2: { label: "Gel", least: 0, most: 2000, start: 0 },
};
const kWind = {
  speed: { label: "Wind, m/s", least: 0, most: 12, start: 0 },
  bearing: { label: "Wind from, deg", least: -180, most: 180, start: 90 },
  gust: { label: "Gusts", least: 0, most: 1, start: 0.4 },
  turbulence: { label: "Turbulence", least: 0, most: 4, start: 0.5 },
} satisfies Record<string, Slider>;

/** Sliders of the user's own hair and of the room's wind. */
export class Sliders {
  readonly #material = new Map<string, HTMLInputElement>();
  readonly #wind = new Map<string, HTMLInputElement>();

  constructor(place: HTMLElement, onMaterial: (scale: MaterialScale) => void, onWind: (wind: Wind) => void) {
    addSliders(place, kMaterial, this.#material, () => onMaterial(this.material));
    addSliders(place, kWind, this.#wind, () => onWind(this.#readWind()));
  }

  get material(): MaterialScale {
    const read = (name: keyof MaterialScale) => valueOfSlider(kMaterial[name], this.#material.get(name));
    return {
      stiffness: read("stiffness"),
      damping: read("damping"),
      density: read("density"),
      etherDamping: read("etherDamping"),
      airDrag: read("airDrag"),
      gelPerS2: read("gelPerS2"),
    };
  }

  /** Moves the sliders. */
  set material(scale: MaterialScale) {
    for (const [name, slider] of Object.entries(kMaterial)) {
      const input = this.#material.get(name);
      if (input) input.value = String(placeOnSlider(slider, scale[name as keyof MaterialScale]));
    }
  }

  #readWind(): Wind {
    const read = (name: keyof typeof kWind) => valueOfSlider(kWind[name], this.#wind.get(name));
    const from = (read("bearing") * Math.PI) / 180;
    const speed = read("speed");
    return {
      meanMPerS: [-speed * Math.sin(from), 0, -speed * Math.cos(from)],
      gustRatio: read("gust"),
      gustPeriodS: 4,
      turbulenceRmsMPerS: speed > 0 ? read("turbulence") : 0,
      turbulenceScaleM: 0.6,
      seed: 1n,
    };
  }
}

function addSliders(
  place: HTMLElement,
  sliders: Record<string, Slider>,
  inputs: Map<string, HTMLInputElement>,
  onInput: () => void,
): void {
  for (const [name, slider] of Object.entries(sliders)) {
    const row = document.createElement("label");
    row.className = "row";
    const label = document.createElement("span");
    label.textContent = slider.label;
    const input = document.createElement("input");
    input.type = "range";
    input.name = name;
    input.min = "0";
    input.max = "1";
    input.step = "any";
    const start = placeOnSlider(slider, slider.start);
    input.value = String(start);
    let isWaiting = false;
    input.addEventListener("input", () => {
      // Sends a few times a second, which is enough for a server.
      if (isWaiting) return;
      isWaiting = true;
      setTimeout(() => {
        isWaiting = false;
        onInput();
      }, 120);
    });
    input.addEventListener("dblclick", () => {
      input.value = String(start);
      onInput();
    });
    row.append(label, input);
    place.append(row);
    inputs.set(name, input);
  }
}

function placeOnSlider({ least, most, isLogarithmic }: Slider, value: number): number {
  const bounded = Math.min(Math.max(value, least), most);
  return isLogarithmic ? Math.log(bounded / least) / Math.log(most / least) : (bounded - least) / (most - least);
}

function valueOfSlider(slider: Slider, input: HTMLInputElement | undefined): number {
  if (!input) return slider.start;
  const at = Number(input.value);
  if (slider.isLogarithmic) return slider.least * (slider.most / slider.least) ** at;
  return slider.least + at * (slider.most - slider.least);
}
