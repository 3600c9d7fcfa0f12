import { displacementsOf, type Basis, type HairBasis } from "./basis";
import { expandDisplacements, nodeCount, type LevelGeometry } from "./lattice";

/** A lattice at one moment. */
export interface MovedLattice {
  readonly geometry: LevelGeometry;
  /** displacements: 3 a grid node, head space, m */
  readonly grid: Float32Array;
  /** of which `grid` is the sum: with them the GPU computes it by itself; absent: of none */
  readonly modes?: MovedModes;
  /** nearly the same, in half the time, for what needs no more; absent: there is no such */
  readonly coarse?: MovedLattice;
}

export interface MovedModes {
  readonly basis: Basis;
  /** m; those that are missing at the end are 0 */
  readonly coefficients: Float32Array;
}

/** Of `ModeLattice.coarse`. The others are a twentieth of lively motion: 11 of 196 mm for long curls (RMS). */
const kCoarseModes = 64;

/** A lattice that moves in the modes of a basis. Its nodes are computed when a caller wants them. */
export class ModeLattice implements MovedLattice {
  readonly coarse?: ModeLattice;
  #coefficients: Float32Array = new Float32Array(0);
  #active: Float32Array | null = null;
  #grid: Float32Array | null = null;
  /** that `#grid` is of */
  #computed: Float32Array | null = null;

  /** `modesMax`: the others are left out. */
  constructor(
    readonly hair: HairBasis,
    private readonly modesMax = Infinity,
  ) {
    if (modesMax > kCoarseModes) this.coarse = new ModeLattice(hair, kCoarseModes);
  }

  get geometry(): LevelGeometry {
    return this.hair.geometry;
  }

  get modes(): MovedModes {
    return { basis: this.hair.basis, coefficients: this.#coefficients };
  }

  get grid(): Float32Array {
    const { geometry, basis } = this.hair;
    this.#grid ??= new Float32Array(3 * nodeCount(geometry.lattice));
    const coefficients = this.#coefficients;
    // Sleeping hair is not computed again.
    const isSame =
      coefficients.length === this.#computed?.length && coefficients.every((c, k) => c === this.#computed![k]);
    if (isSame) return this.#grid;
    this.#active ??= new Float32Array(3 * basis.nodeCount);
    displacementsOf(basis, coefficients, this.#active);
    expandDisplacements(geometry, this.#active, this.#grid);
    this.#computed = coefficients.slice();
    return this.#grid;
  }

  /** Keeps the array until the next call. */
  show(coefficients: Float32Array): void {
    this.#coefficients = coefficients.length > this.modesMax ? coefficients.subarray(0, this.modesMax) : coefficients;
    this.coarse?.show(coefficients);
  }
}
