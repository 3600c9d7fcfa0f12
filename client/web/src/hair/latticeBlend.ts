import type { LevelGeometry } from "./lattice";
import { expandDisplacements, nodeCount } from "./lattice";
import { Level } from "./level";
import type { PlayoutSample } from "./playout";

/** How long a switch of level takes to fade. */
export const kSwitchBlendNs = 400_000_000;
/** Layers that are kept at a time; of switches that follow each other closer, the weakest are left out. */
export const kLayersMax = 5;

/** A lattice whose FFD counts with a weight: hair's displacement is u(x) = sum of weight * FFD(x) over the layers. */
export interface LatticeLayer {
  readonly geometry: LevelGeometry;
  /** 3 a grid node, head space, m */
  readonly grid: Float32Array;
  readonly weight: number;
  /** its lattice will not change any more, only its weight: what was sent to a GPU can stay there */
  readonly frozen: boolean;
}

class Layer implements LatticeLayer {
  geometry: LevelGeometry;
  grid: Float32Array;
  weight = 1;
  frozen = false;
  /** at the switch; the weight is as much of it as has not faded yet */
  weightAtSwitch = 1;

  constructor(geometry: LevelGeometry) {
    this.geometry = geometry;
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
  #fading: Layer[] = [];
  readonly #layers: Layer[] = [];
  #level = Level.rigid;
  #started = false;
  #switchedNs = 0;

  /**
   * The layers that show a sample of `Playout`: the newest first, of weight 1, unless it is rigid. They belong to this
   * object until the next call. A `discontinuous` sample begins anew.
   */
  update(sample: PlayoutSample): readonly LatticeLayer[] {
    const geometry = sample.displacement.length > 0 ? sample.geometry : null;
    const before = this.#current;
    const switched = this.#started && (sample.level !== this.#level || this.#rebuilt(geometry));
    if (sample.discontinuous || !this.#started) this.#fading = [];
    else this.#fade(sample.timeNs);
    const fades = switched && !sample.discontinuous;
    if (fades && before) {
      before.frozen = true;
      this.#fading.push(before);
    }
    if (!geometry) this.#current = null;
    else if (fades || !before || before.geometry !== geometry) this.#current = new Layer(geometry);
    if (geometry) expandDisplacements(geometry, sample.displacement, this.#current!.grid);
    if (fades) this.#beginFade(sample.timeNs);
    this.#started = true;
    this.#level = sample.level;
    this.#layers.length = 0;
    if (this.#current) this.#layers.push(this.#current);
    this.#layers.push(...this.#fading);
    return this.#layers;
  }

  /** The same level, of a server that built it otherwise. */
  #rebuilt(geometry: LevelGeometry | null): boolean {
    return geometry !== null && this.#current !== null && geometry !== this.#current.geometry;
  }

  #fade(timeNs: number): void {
    const gone = Math.min(Math.max((timeNs - this.#switchedNs) / kSwitchBlendNs, 0), 1);
    const left = 1 - gone * gone * (3 - 2 * gone);
    if (left <= 0) this.#fading = [];
    for (const layer of this.#fading) layer.weight = left * layer.weightAtSwitch;
  }

  /** What is fading, the old lattice among it, less the new one as it is now: all of it fades from now on. */
  #beginFade(timeNs: number): void {
    this.#switchedNs = timeNs;
    if (this.#current) {
      const frozen = new Layer(this.#current.geometry);
      frozen.grid.set(this.#current.grid);
      frozen.frozen = true;
      frozen.weight = -1;
      this.#fading.push(frozen);
    }
    const room = kLayersMax - (this.#current ? 1 : 0);
    if (this.#fading.length > room) {
      // Those of one switch come in pairs of equal weight and are left out together.
      const weights = this.#fading.map((layer) => Math.abs(layer.weight)).sort((a, b) => b - a);
      const least = weights[room - 1];
      const next = weights[room];
      this.#fading = this.#fading.filter((layer) => Math.abs(layer.weight) >= least && Math.abs(layer.weight) > next);
    }
    for (const layer of this.#fading) layer.weightAtSwitch = layer.weight;
  }
}
