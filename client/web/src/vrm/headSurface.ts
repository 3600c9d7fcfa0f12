import { Vector3 } from "three";

/** Triangles in head space, m: 9 numbers each. */
export type Triangles = readonly number[];

// The directions are 7.5 degrees apart, from pole to pole and around.
const kRows = 24;
const kColumns = 48;

/** The outer surface of triangles around a point, as a distance for each direction from the point. */
export class HeadSurface {
  /**
   * The distances, m: row by row from +Y down, with columns from +Z towards +X. 0 means that no triangle lies in this
   * direction.
   */
  readonly #radii = new Float64Array((kRows + 1) * kColumns);

  constructor(
    triangles: Triangles,
    readonly middle: Vector3,
  ) {
    const [a, b, c] = [new Vector3(), new Vector3(), new Vector3()];
    for (let t = 0; t < triangles.length; t += 9) {
      a.fromArray(triangles, t).sub(middle);
      b.fromArray(triangles, t + 3).sub(middle);
      c.fromArray(triangles, t + 6).sub(middle);
      this.#add(a, b, c);
    }
  }

  /** The distance from the middle in the direction of `v`, m; 0 where there is no surface. */
  radius(v: Vector3): number {
    const row = (Math.acos(Math.min(Math.max(v.y / v.length(), -1), 1)) / Math.PI) * kRows;
    const column = ((Math.atan2(v.x, v.z) / (2 * Math.PI) + 1) * kColumns) % kColumns;
    const firstRow = Math.min(Math.floor(row), kRows - 1);
    const firstColumn = Math.floor(column);
    let sum = 0;
    let weights = 0;
    for (const [r, ofRow] of [
      [firstRow, 1 - (row - firstRow)],
      [firstRow + 1, row - firstRow],
    ])
      for (const [k, ofColumn] of [
        [firstColumn, 1 - (column - firstColumn)],
        [(firstColumn + 1) % kColumns, column - firstColumn],
      ]) {
        const radius = this.#radii[r * kColumns + k];
        if (radius === 0) continue;
        sum += ofRow * ofColumn * radius;
        weights += ofRow * ofColumn;
      }
    return weights > 0 ? sum / weights : 0;
  }

  // A ray from the middle along d meets the triangle if d is on the same side of the three planes through its edges.
  #add(a: Vector3, b: Vector3, c: Vector3): void {
    ab.crossVectors(a, b);
    bc.crossVectors(b, c);
    ca.crossVectors(c, a);
    const volume = a.dot(bc);
    const cone = centroid
      .copy(a)
      .normalize()
      .add(corner.copy(b).normalize())
      .add(corner.copy(c).normalize())
      .normalize();
    const least = Math.min(cone.dot(a) / a.length(), cone.dot(b) / b.length(), cone.dot(c) / c.length()) - 1e-6;
    // `cone` is the axis of a cone that contains the triangle, and `least` the cosine of its half angle. Only
    // directions within the cone can meet the triangle, and they lie in these rows.
    const polar = Math.acos(Math.min(Math.max(cone.y, -1), 1));
    const reach = least > 0 ? Math.acos(Math.min(least, 1)) : Math.PI;
    const firstRow = Math.max(Math.floor(((polar - reach) / Math.PI) * kRows), 0);
    const lastRow = Math.min(Math.ceil(((polar + reach) / Math.PI) * kRows), kRows);
    for (let n = firstRow * kColumns; n < (lastRow + 1) * kColumns; ++n) {
      const d = kDirections[n];
      if (least > 0 && cone.dot(d) < least) continue;
      const [x, y, z] = [d.dot(ab), d.dot(bc), d.dot(ca)];
      if ((x < 0 || y < 0 || z < 0) && (x > 0 || y > 0 || z > 0)) continue;
      const radius = volume / (x + y + z);
      if (radius > this.#radii[n] && Number.isFinite(radius)) this.#radii[n] = radius;
    }
  }
}

const ab = new Vector3();
const bc = new Vector3();
const ca = new Vector3();
const centroid = new Vector3();
const corner = new Vector3();

const kDirections = Array.from({ length: (kRows + 1) * kColumns }, (_, n) => {
  const polar = (Math.PI * Math.floor(n / kColumns)) / kRows;
  return new Vector3().setFromSphericalCoords(1, polar, (2 * Math.PI * (n % kColumns)) / kColumns);
});

/** A point inside the skull: below the crown by a little more than half of the head's width. Null: there is no head. */
export function middleOf(triangles: Triangles): Vector3 | null {
  const along = (axis: number) => triangles.filter((_, n) => n % 3 === axis).sort((a, b) => a - b);
  const share = (sorted: readonly number[], of: number) => sorted[Math.round(of * (sorted.length - 1))];
  // Four triangles are the least that enclose anything. Shares of the sorted coordinates in place of the ends leave out
  // ears, horns and single points.
  if (triangles.length < 36) return null;
  const [xs, ys, zs] = [0, 1, 2].map(along);
  const halfWidth = 0.5 * (share(xs, 0.98) - share(xs, 0.02));
  const height = ys[ys.length - 1] - ys[0];
  if (!(halfWidth > 0.005) || !(height > 0.01)) return null;
  return new Vector3(0, share(ys, 0.99) - 1.2 * halfWidth, 0.5 * (share(zs, 0.02) + share(zs, 0.98)));
}

/**
 * Directions, evenly spread, over the part of a head that carries hair. They are those of a Fibonacci sphere of 600
 * points that lie above a plane from the forehead to the nape, which is tilted by 0.7 rad.
 */
export const kScalp: readonly Vector3[] = Array.from({ length: 600 }, (_, n) => {
  const y = 1 - (2 * n + 1) / 600;
  const turn = n * Math.PI * (3 - Math.sqrt(5));
  const flat = Math.sqrt(1 - y * y);
  return new Vector3(flat * Math.sin(turn), y, flat * Math.cos(turn));
}).filter((direction) => direction.dot(new Vector3(0, Math.cos(0.7), -Math.sin(0.7))) > 0.05);
