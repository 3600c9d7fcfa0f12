import { kModeCountMax } from "../generated/constants";
import { HairnetError } from "./hairnetError";
import type { LevelGeometry } from "./lattice";
import type { Skin } from "./skin";

/**
 * The shapes in which the hair of one groom moves, the most important first. The displacements of the active nodes of the
 * finest level are the sum of the modes, each times its coefficient. A coefficient is a distance in metres: an error of a
 * coefficient is an equal error of the hair on the mean. Immutable.
 */
export interface Basis {
  /** active nodes of the finest level */
  readonly nodeCount: number;
  /** RMS of each coefficient over the training motions, not ascending */
  readonly deviationM: Float32Array;
  /** of each mode: what an integer of 1 stands for; no dimension */
  readonly unit: Float32Array;
  /** by mode, then by active node: x, y, z; head axes */
  readonly modes: Int16Array;
}

/**
 * What draws the hair of a groom from coefficients: the finest level's lattice and its modes, and the skin to keep it
 * out of. Immutable.
 */
export interface HairBasis {
  readonly geometry: LevelGeometry;
  readonly basis: Basis;
  readonly skin: Skin;
}

/** Describes a fault of a basis in one line, or returns null. */
export function basisFault(basis: Basis): string | null {
  const { nodeCount, deviationM, unit, modes } = basis;
  const count = deviationM.length;
  if (count === 0 || count > kModeCountMax) return `a basis has 1 to ${kModeCountMax} modes`;
  if (nodeCount === 0) return "a basis without nodes";
  if (unit.length !== count) return "a basis with another number of units than modes";
  if (modes.length !== 3 * count * nodeCount) return "a basis whose modes have another number of nodes";
  if (!unit.every(isSize)) return "a basis with a unit that is not positive";
  if (!deviationM.every(isSize)) return "a basis with a deviation that is not positive";
  if (deviationM.some((each, k) => k > 0 && each > deviationM[k - 1])) return "a basis whose deviations ascend";
  return null;
}

/** Throws `HairnetError` unless the basis is valid. */
export function validateBasis(basis: Basis): void {
  const fault = basisFault(basis);
  if (fault) throw new HairnetError("invalid", fault);
}

function isSize(value: number): boolean {
  return Number.isFinite(value) && value > 0;
}

/**
 * Displacements of the active nodes from the first coefficients (m), at most one a mode; the others are 0. `out` has 3
 * numbers for each node (head space, m). Rounds as C++ does. Allocates nothing.
 */
export function displacementsOf(basis: Basis, coefficients: Float32Array, out: Float32Array): void {
  const { unit, modes } = basis;
  const numbers = 3 * basis.nodeCount;
  out.fill(0, 0, numbers);
  for (let k = 0; k < coefficients.length; ++k) {
    const scale = Math.fround(coefficients[k] * unit[k]);
    if (scale === 0) continue;
    const mode = k * numbers;
    for (let i = 0; i < numbers; ++i) out[i] += Math.fround(scale * modes[mode + i]);
  }
}
