import { Vector3, type Matrix4 } from "three";

/**
 * How much scales of axes may differ, as a share of the largest one, and how large the cosine between two axes may be.
 * Bones that animations scale are off by less.
 */
const kTolerance = 0.01;
const axes = [new Vector3(), new Vector3(), new Vector3()] as const;

/**
 * The scale of a world matrix, negative where it mirrors; 0 where it hides. Null: it scales or shears axes differently,
 * which hair, whose head is moved rigidly, cannot follow. NaN: it is not finite.
 */
export function evenScale(matrix: Matrix4): number | null {
  const [x, y, z] = axes.map((axis, n) => axis.setFromMatrixColumn(matrix, n).length());
  const largest = Math.max(x, y, z);
  if (!Number.isFinite(matrix.elements.reduce((sum, element) => sum + element, 0))) return NaN;
  if (largest === 0) return 0;
  const cosines = [axes[0].dot(axes[1]), axes[1].dot(axes[2]), axes[2].dot(axes[0])];
  const isEven = Math.min(x, y, z) >= (1 - kTolerance) * largest;
  if (!isEven || cosines.some((cosine) => Math.abs(cosine) > kTolerance * largest * largest)) return null;
  return Math.cbrt(matrix.determinant());
}
