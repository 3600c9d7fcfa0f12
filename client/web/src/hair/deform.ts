import { HairnetError } from "./hairnetError";
import type { Lattice } from "./lattice";
import { nodeCount } from "./lattice";
import type { RestTangents } from "./restTangents";

export type FfdKind = "quadratic" | "linear";

/** The output of a `Deformer`. */
export interface DeformOutput {
  /** 3 a point, head space, m */
  readonly points: Float32Array;
  /** 3 a point: d(points)/ds, s the arc length at rest. Not of unit length: longer where hair is stretched. */
  readonly tangents?: Float32Array;
}

/**
 * Deforms a fixed set of points, given at rest in head space, by displacements of a lattice's nodes: x_i + delta_i
 * u(x_i), u(x) = sum_j w_j(x) displacement_j. Outside of the lattice its border nodes extrapolate linearly. The
 * constructor finds each point's place in the lattice once. `deform` allocates nothing.
 */
export class Deformer {
  readonly pointCount: number;
  readonly #lattice: Lattice;
  readonly #kind: FfdKind;
  readonly #points: Float32Array;
  readonly #blend: Float32Array | null;
  readonly #rest: RestTangents | null;
  /** Grid index of the lowest node of each point's stencil. */
  readonly #base: Uint32Array;
  /** Position from the stencil's middle node (quadratic) or lowest node (linear), in node spacings; 3 a point. */
  readonly #t: Float64Array;
  // Weights along the axes and their derivatives, 1/m: 3 each of x, y, z.
  readonly #w = new Float64Array(9);
  readonly #slope = new Float64Array(9);

  /**
   * `points`: 3 each. `blend`: delta of each point, or null for 1. `rest`: the hair's direction at each point, needed
   * for tangents.
   */
  constructor(
    lattice: Lattice,
    points: Float32Array,
    blend: Float32Array | null,
    kind: FfdKind,
    rest: RestTangents | null = null,
  ) {
    this.pointCount = points.length / 3;
    if (kind === "quadratic" && Math.min(...lattice.dims) < 3)
      throw new HairnetError("invalid", "quadratic FFD needs 3 nodes on each axis");
    if (points.length % 3 !== 0 || (blend && blend.length !== this.pointCount))
      throw new HairnetError("invalid", "points are not 3 numbers each, or the root blend is not one each");
    if (rest && (rest.direction.length !== points.length || rest.blendSlope.length !== this.pointCount))
      throw new HairnetError("invalid", "rest tangents are not one a point");
    this.#lattice = lattice;
    this.#kind = kind;
    this.#points = points;
    this.#blend = blend;
    this.#rest = rest;
    this.#base = new Uint32Array(this.pointCount);
    this.#t = new Float64Array(points.length);
    for (let p = 0; p < this.pointCount; ++p) this.#place(p);
  }

  /** `grid`: displacements of every grid node, 3 each (`expandDisplacements`); `out`: memory for all points. */
  deform(grid: Float32Array, out: DeformOutput): void {
    const { points, tangents } = out;
    if (grid.length !== 3 * nodeCount(this.#lattice) || points.length !== this.#points.length)
      throw new HairnetError("invalid", "displacements are not one a grid node, or no room for the points");
    if (tangents && (!this.#rest || tangents.length !== points.length))
      throw new HairnetError("invalid", "this deformer was made without tangents, or there is no room for them");
    const [nx, ny] = this.#lattice.dims;
    const count = this.#kind === "quadratic" ? 3 : 2;
    const row = 3 * (nx - count);
    const slice = 3 * nx * (ny - count);
    const w = this.#w;
    const slope = this.#slope;
    for (let p = 0; p < this.pointCount; ++p) {
      const at = 3 * p;
      this.#weigh(at);
      let ux = 0;
      let uy = 0;
      let uz = 0;
      // The gradient of u along the rest tangent.
      let gx = 0;
      let gy = 0;
      let gz = 0;
      const direction = tangents ? this.#rest!.direction : null;
      const tx = direction ? direction[at] : 0;
      const ty = direction ? direction[at + 1] : 0;
      const tz = direction ? direction[at + 2] : 0;
      let node = 3 * this.#base[p];
      for (let k = 0; k < count; ++k, node += slice) {
        for (let j = 0; j < count; ++j, node += row) {
          const wyz = w[3 + j] * w[6 + k];
          const across = ty * slope[3 + j] * w[6 + k] + tz * w[3 + j] * slope[6 + k];
          for (let i = 0; i < count; ++i, node += 3) {
            const weight = w[i] * wyz;
            ux += weight * grid[node];
            uy += weight * grid[node + 1];
            uz += weight * grid[node + 2];
            if (direction) {
              const along = tx * slope[i] * wyz + w[i] * across;
              gx += along * grid[node];
              gy += along * grid[node + 1];
              gz += along * grid[node + 2];
            }
          }
        }
      }
      const delta = this.#blend ? this.#blend[p] : 1;
      points[at] = this.#points[at] + delta * ux;
      points[at + 1] = this.#points[at + 1] + delta * uy;
      points[at + 2] = this.#points[at + 2] + delta * uz;
      if (tangents) {
        const rise = this.#rest!.blendSlope[p];
        tangents[at] = tx + delta * gx + rise * ux;
        tangents[at + 1] = ty + delta * gy + rise * uy;
        tangents[at + 2] = tz + delta * gz + rise * uz;
      }
    }
  }

  #place(p: number): void {
    const { origin, spacing, dims } = this.#lattice;
    const quadratic = this.#kind === "quadratic";
    const lowest = [0, 0, 0];
    for (let axis = 0; axis < 3; ++axis) {
      const g = (this.#points[3 * p + axis] - origin[axis]) / spacing[axis];
      const nearest = Math.min(Math.max(quadratic ? Math.round(g) : Math.floor(g), quadratic ? 1 : 0), dims[axis] - 2);
      lowest[axis] = nearest - (quadratic ? 1 : 0);
      this.#t[3 * p + axis] = g - nearest;
    }
    this.#base[p] = lowest[0] + dims[0] * (lowest[1] + dims[1] * lowest[2]);
  }

  /** Linear beyond half a spacing from the outermost stencil's middle; value and slope are continuous there. */
  #weigh(at: number): void {
    const w = this.#w;
    const slope = this.#slope;
    for (let axis = 0; axis < 3; ++axis) {
      const t = this.#t[at + axis];
      const perM = 1 / this.#lattice.spacing[axis];
      const n = 3 * axis;
      if (this.#kind === "linear") {
        w[n] = 1 - t;
        w[n + 1] = t;
        slope[n] = -perM;
        slope[n + 1] = perM;
      } else if (t < -0.5) {
        w[n] = -t;
        w[n + 1] = 1 + t;
        w[n + 2] = 0;
        slope[n] = -perM;
        slope[n + 1] = perM;
        slope[n + 2] = 0;
      } else if (t > 0.5) {
        w[n] = 0;
        w[n + 1] = 1 - t;
        w[n + 2] = t;
        slope[n] = 0;
        slope[n + 1] = -perM;
        slope[n + 2] = perM;
      } else {
        w[n] = 0.5 * (0.5 - t) * (0.5 - t);
        w[n + 1] = 0.75 - t * t;
        w[n + 2] = 0.5 * (0.5 + t) * (0.5 + t);
        slope[n] = (t - 0.5) * perM;
        slope[n + 1] = -2 * t * perM;
        slope[n + 2] = (t + 0.5) * perM;
      }
    }
  }
}
