import { kLatticeLayersMax } from "../generated/constants";
import type { LevelGeometry } from "./lattice";
import { expandDisplacements, nodeCount } from "./lattice";
import { LevelIndex } from "./level";
import type { PlayoutSample } from "./playout";
import { smoothstep } from "./smoothstep";

/** How long a switch of level takes to fade. */
export const kSwitchBlendNs = 400_000_000;
/** Layers at a time: the newest, and two switches. Of more that follow each other closer the weakest is left out. */
const kSwitchesMax = (kLatticeLayersMax - 1) / 2;

/** A lattice whose FFD counts with a weight: hair's displacement is u(x) = sum of weight * FFD(x) over the layers. */
export interface LatticeLayer {
  readonly geometry: LevelGeometry;
  /** 3 a grid node, head space, m */
  readonly grid: Float32Array;
  readonly weight: number;
}

class Layer implements LatticeLayer {
  readonly grid: Float32Array;
  weight = 1;
  /** what is left of it at the switch that it fades from */
  weightAtSwitch = 1;
  /** number of the switch that froze it */
  switchNumber = 0;

  constructor(readonly geometry: LevelGeometry) {
    this.grid = new Float32Array(3 * nodeCount(geometry.lattice));
  }
}

/**
 * A coarse level cannot show every shape of a finer one. Where a character's level changes, hair would jump by the
 * difference: it is kept, and fades over `kSwitchBlendNs`. As that difference is one of two FFDs, it is shown as layers,
 * frozen at the switch: the old lattice with weight w, the new one with weight -w. One for each character.
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
   * Returns the layers that show a sample of `Playout`: the newest first, with weight 1, unless it is rigid. They are
   * valid until the next call. `discontinuous`, or another lattice of the same level, ends all fades. (Frames are also
   * discontinuous where the level changes; do not pass `discontinuous` then, or the change will not fade.)
   */
  update(sample: PlayoutSample, discontinuous = false): readonly LatticeLayer[] {
    const geometry = sample.displacement.length > 0 ? sample.geometry : null;
    const before = this.#current;
    const sameLevel = sample.level === this.#level;
    const isRebuilt = sameLevel && geometry !== null && before !== null && geometry !== before.geometry;
    const beginsAnew = discontinuous || isRebuilt || !this.#started;
    if (beginsAnew) this.#fading = [];
    // What is on the screen at a switch is what was shown last.
    const switched = !beginsAnew && !sameLevel;
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

  /** What was shown, the lattice before the switch and what was fading, less the new lattice: all fades from now on. */
  #beginFade(before: Layer | null, timeNs: number): void {
    this.#switchedNs = timeNs;
    ++this.#switchNumber;
    if (before) this.#freeze(before, 1);
    if (this.#current) {
      const frozen = new Layer(this.#current.geometry);
      frozen.grid.set(this.#current.grid);
      this.#freeze(frozen, -1);
    }
    // Those of one switch belong together, and those of the oldest are the weakest.
    this.#fading = this.#fading.filter((layer) => layer.switchNumber > this.#switchNumber - kSwitchesMax);
    for (const layer of this.#fading) layer.weightAtSwitch = layer.weight;
  }

  #freeze(layer: Layer, weight: number): void {
    layer.weight = weight;
    layer.switchNumber = this.#switchNumber;
    this.#fading.push(layer);
  }
}
