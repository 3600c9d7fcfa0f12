import { kLatticeLayersMax } from "../generated/constants";
import type { LevelGeometry } from "./lattice";
import { expandDisplacements, nodeCount } from "./lattice";
import { LevelIndex } from "./level";
import type { PlayoutSample } from "./playout";
import { smoothstep } from "./smoothstep";

/** The duration of the fade after a level switch. */
export const kSwitchBlendNs = 400_000_000;
/** Layers at a time: the newest, and two switches. With more switches in quick succession, the weakest is left out. */
const kSwitchesMax = (kLatticeLayersMax - 1) / 2;

/** A lattice with the weight of its FFD: the hair's displacement is u(x) = sum of weight * FFD(x) over the layers. */
export interface LatticeLayer {
  readonly geometry: LevelGeometry;
  /** 3 a grid node, head space, m */
  readonly grid: Float32Array;
  readonly weight: number;
}

class Layer implements LatticeLayer {
  readonly grid: Float32Array;
  weight = 1;
  /** its weight at the switch from which it fades */
  weightAtSwitch = 1;
  /** number of the switch that froze it */
  switchNumber = 0;

  constructor(readonly geometry: LevelGeometry) {
    this.grid = new Float32Array(3 * nodeCount(geometry.lattice));
  }
}

/**
 * A coarse level cannot show every shape of a finer one, so hair would jump at a level switch. This adds the difference
 * back, and lets it fade over `kSwitchBlendNs`. The difference of two FFDs is shown as two layers, frozen at the
 * switch: the old lattice with weight w, the new one with weight -w. One object for each character.
 */
export class LatticeBlend {
  /** the newest, if not rigid; its lattice is that of the last sample */
  #current: Layer | null = null;
  /** of the oldest switch first */
  #fading: Layer[] = [];
  readonly #layers: Layer[] = [];
  #level = LevelIndex.rigid;
  #started = false;
  #switchedNs = 0;
  #switchNumber = 0;

  /**
   * Returns the layers for a sample of `Playout`: the newest first, with weight 1, unless it is rigid. They are valid
   * until the next call. `discontinuous`, or another lattice of the same level, ends all fades. (Frames are also
   * discontinuous at a level switch; do not pass `discontinuous` then, or the switch will not fade.)
   */
  update(sample: PlayoutSample, discontinuous = false): readonly LatticeLayer[] {
    const geometry = sample.displacement.length > 0 ? sample.geometry : null;
    const before = this.#current;
    const sameLevel = sample.level === this.#level;
    const isRebuilt = sameLevel && geometry !== null && before !== null && geometry !== before.geometry;
    const restarts = discontinuous || isRebuilt || !this.#started;
    if (restarts) this.#fading = [];
    // The shown state before a switch is that of the last sample.
    const switched = !restarts && !sameLevel;
    if (!switched) this.#fade(sample.timeNs);
    if (!geometry) this.#current = null;
    else if (switched || before?.geometry !== geometry) this.#current = new Layer(geometry);
    if (this.#current) expandDisplacements(this.#current.geometry, sample.displacement, this.#current.grid);
    if (switched) this.#beginFade(before, sample.timeNs);
    this.#started = true;
    this.#level = sample.level;
    this.#layers.length = 0;
    if (this.#current) this.#layers.push(this.#current);
    this.#layers.push(...this.#fading);
    return this.#layers;
  }

  #fade(timeNs: number): void {
    if (this.#fading.length === 0) return;
    const left = 1 - smoothstep(0, kSwitchBlendNs, timeNs - this.#switchedNs);
    if (left <= 0) this.#fading = [];
    for (const layer of this.#fading) layer.weight = left * layer.weightAtSwitch;
  }

  /** Begins to fade the lattice before the switch and the layers that were fading, minus the new lattice. */
  #beginFade(before: Layer | null, timeNs: number): void {
    this.#switchedNs = timeNs;
    ++this.#switchNumber;
    if (before) this.#freeze(before, 1);
    if (this.#current) {
      const frozen = new Layer(this.#current.geometry);
      frozen.grid.set(this.#current.grid);
      this.#freeze(frozen, -1);
    }
    // The layers of one switch belong together, and those of the oldest switch are the weakest.
    this.#fading = this.#fading.filter((layer) => layer.switchNumber > this.#switchNumber - kSwitchesMax);
    for (const layer of this.#fading) layer.weightAtSwitch = layer.weight;
  }

  #freeze(layer: Layer, weight: number): void {
    layer.weight = weight;
    layer.switchNumber = this.#switchNumber;
    this.#fading.push(layer);
  }
}
