import { kBare, kCardRoots, kFull, kReachMinM, kSamples, kSkullM2, kSpacings } from "../../generated/constants";
import type { Groom } from "../../hair/groom";
import { smoothstep } from "../../hair/smoothstep";

/** Where the roots of a groom grow on the skin: the skin there is drawn in the colour of the hair. */
export class Scalp {
  readonly #roots: Float32Array; // 3 each, by their x
  readonly #reachM: number = 0;
  readonly #usual: number = 1; // density where roots are

  constructor(groom: Groom) {
    this.#roots = rootsOf(groom);
    const count = this.#roots.length / 3;
    if (count === 0) return;
    this.#reachM = Math.max(kReachMinM, kSpacings * Math.sqrt(kSkullM2 / count));
    const densities: number[] = [];
    for (let r = 0; r < count; r += Math.ceil(count / kSamples))
      densities.push(this.#density(this.#roots[3 * r], this.#roots[3 * r + 1], this.#roots[3 * r + 2]));
    densities.sort((a, b) => a - b);
    this.#usual = densities[densities.length >> 1];
  }

  /**
   * How far a point belongs to the scalp: 1 where roots are as dense as usual on this groom, including partings between
   * rows of roots; it falls to 0 within reach of the outermost roots.
   */
  at(x: number, y: number, z: number): number {
    return smoothstep(kBare, kFull, this.#density(x, y, z) / this.#usual);
  }

  #density(x: number, y: number, z: number): number {
    const roots = this.#roots;
    const reach = this.#reachM;
    let first = 0;
    for (let end = roots.length / 3; first < end; ) {
      const middle = (first + end) >> 1;
      if (roots[3 * middle] < x - reach) first = middle + 1;
      else end = middle;
    }
    let sum = 0;
    for (let at = 3 * first; at < roots.length && roots[at] <= x + reach; at += 3) {
      const dx = roots[at] - x;
      const dy = roots[at + 1] - y;
      const dz = roots[at + 2] - z;
      const within = Math.max(1 - (dx * dx + dy * dy + dz * dz) / (reach * reach), 0);
      sum += within * within;
    }
    return sum;
  }
}

function rootsOf({ strands, cards, points }: Groom): Float32Array {
  const roots: number[][] = [];
  for (let s = 0; s < strands.count; ++s) {
    const at = 3 * strands.begin[s];
    if (strands.begin[s] < strands.begin[s + 1] && strands.rooted[s]) roots.push([...points.subarray(at, at + 3)]);
  }
  for (const card of cards) {
    if (card.points.end - card.points.begin < 2 || !card.rooted) continue;
    const at = 3 * card.points.begin;
    for (let i = 0; i < kCardRoots; ++i) {
      const t = i / (kCardRoots - 1);
      roots.push([0, 1, 2].map((axis) => points[at + axis] + t * (points[at + 3 + axis] - points[at + axis])));
    }
  }
  roots.sort((a, b) => a[0] - b[0]);
  return Float32Array.from(roots.flat());
}
