/**
 * Limits deformed strands to their length at rest: a lattice stretches in wild motion, hair does not. Point i is at the
 * arc length min(L_i, l_i) from the root on its deformed strand, where L_i is the deformed arc length and l_i that at
 * rest. So a stretched strand follows its deformed curve and ends early. `core/ffd/strand_lengths.hpp` has the reasons.
 */
export class StrandLengths {
  readonly #begin: ArrayLike<number>;
  /** l_i of each point, m */
  readonly #restArc: Float32Array;
  readonly #arc: Float32Array;

  /** `points` at rest, 3 numbers each; strand s has points begin[s] to begin[s + 1]. */
  constructor(points: Float32Array, begin: ArrayLike<number>) {
    this.#begin = begin;
    this.#restArc = new Float32Array(begin[begin.length - 1] ?? 0);
    this.#arc = new Float32Array(this.#restArc.length);
    this.#measure(points, this.#restArc);
  }

  /** Moves the deformed `points` so that no strand is longer than at rest. Points after the last strand stay. */
  limit(points: Float32Array): void {
    const arc = this.#arc;
    this.#measure(points, arc);
    for (let s = 0; s + 1 < this.#begin.length; ++s) {
      const root = this.#begin[s];
      // From the tip to the root: a point moves towards the root only, and lies between two points that have not moved
      // yet.
      let after = this.#begin[s + 1];
      for (let i = after - 1; i > root; --i) {
        const wanted = this.#restArc[i];
        if (arc[i] <= wanted) continue;
        after = Math.min(after, i);
        while (arc[after - 1] > wanted) --after;
        const t = (wanted - arc[after - 1]) / (arc[after] - arc[after - 1]);
        for (let axis = 0; axis < 3; ++axis) {
          const from = points[3 * after - 3 + axis];
          points[3 * i + axis] = from + t * (points[3 * after + axis] - from);
        }
      }
    }
  }

  #measure(points: Float32Array, arc: Float32Array): void {
    for (let s = 0; s + 1 < this.#begin.length; ++s) {
      let length = 0;
      for (let i = this.#begin[s]; i < this.#begin[s + 1]; ++i) {
        if (i > this.#begin[s]) {
          const x = points[3 * i] - points[3 * i - 3];
          const y = points[3 * i + 1] - points[3 * i - 2];
          const z = points[3 * i + 2] - points[3 * i - 1];
          length += Math.sqrt(x * x + y * y + z * z);
        }
        arc[i] = length;
      }
    }
  }
}
