import {
  kBodyExtinction,
  kCellMinM,
  kCellsAcross,
  kBetweenPointsM,
  kFade,
  kHairShare,
  kMargin,
  kRays,
} from "../../generated/constants";
import type { Groom } from "../../hair/groom";

/** The fraction of light that reaches one point from each of six directions: +x -x +y -y +z -z of the head. */
export type Transmittance = Float32Array;

const kRayCount = kRays.length;

/**
 * A coarse grid over a groom at rest that stores how much light reaches each cell through hair and body: baked ambient
 * occlusion by direction. Head space, m.
 */
export class OcclusionGrid {
  cellM = 0.01;
  readonly #origin = [0, 0, 0];
  readonly #count = [0, 0, 0];
  /** optical depth of one cell's width; empty: there is no hair */
  readonly #extinction = new Float32Array(0);
  /** transmittance along each ray, kRayCount a cell */
  readonly #transmittance = new Float32Array(0);
  // Scratch values of one lookup.
  readonly #rays = new Float32Array(kRayCount);
  readonly #base = [0, 0, 0];
  readonly #part = [0, 0, 0];

  /** `widthM`: the drawn width of a strand, with its follow hairs. */
  constructor(groom: Groom, widthM: number) {
    if (!this.#layOut(groom)) return;
    const size = this.#count[0] * this.#count[1] * this.#count[2];
    this.#extinction = new Float32Array(size);
    this.#transmittance = new Float32Array(kRayCount * size);
    this.#addHair(groom, widthM);
    this.#addCards(groom);
    this.#addBody(groom.body.vertices, groom.body.triangles);
    for (let ray = 0; ray < kRayCount; ++ray) this.#sweep(ray);
  }

  /**
   * Writes the light of each side into `out`, 0 to 1. Half of it comes from the ray of the side's face, half from the four
   * corners around it. With the `normal` of a surface, light from behind the surface does not count.
   */
  at(x: number, y: number, z: number, out: Transmittance, normal: readonly number[] | null = null): Transmittance {
    out.fill(1);
    if (this.#transmittance.length === 0) return out;
    const base = this.#base;
    const part = this.#part;
    let inside = 1;
    for (let axis = 0; axis < 3; ++axis) {
      const at = ((axis === 0 ? x : axis === 1 ? y : z) - this.#origin[axis]) / this.cellM - 0.5;
      const cells = this.#count[axis];
      const outside = Math.max(-at, at - (cells - 1));
      if (!(outside < kFade)) return out;
      inside *= 1 - Math.max(outside, 0) / kFade;
      base[axis] = Math.min(Math.max(Math.floor(at), 0), cells - 2);
      part[axis] = Math.min(Math.max(at - base[axis], 0), 1);
    }
    const rays = this.#rays.fill(0);
    for (let corner = 0; corner < 8; ++corner) {
      const i = corner & 1;
      const j = (corner >> 1) & 1;
      const k = corner >> 2;
      const weight = (i ? part[0] : 1 - part[0]) * (j ? part[1] : 1 - part[1]) * (k ? part[2] : 1 - part[2]);
      const cell = kRayCount * this.#index(base[0] + i, base[1] + j, base[2] + k);
      for (let ray = 0; ray < kRayCount; ++ray) rays[ray] += weight * this.#transmittance[cell + ray];
    }
    for (let side = 0; side < 6; ++side) {
      const axis = side >> 1;
      const sign = side % 2 === 0 ? 1 : -1;
      let left = 0;
      let weights = 1e-6;
      for (let ray = 0; ray < kRayCount; ++ray) {
        if (kRays[ray][axis] !== sign) continue;
        const weight = (ray < 6 ? 0.5 : 0.125) * (normal ? facing(normal, ray) : 1);
        left += weight * rays[ray];
        weights += weight;
      }
      out[side] = 1 + inside * (left / weights - 1);
    }
    return out;
  }

  #index(x: number, y: number, z: number): number {
    return (z * this.#count[1] + y) * this.#count[0] + x;
  }

  /** The index of the cell at a point, or -1. */
  #find(x: number, y: number, z: number): number {
    const i = (x - this.#origin[0]) / this.cellM;
    const j = (y - this.#origin[1]) / this.cellM;
    const k = (z - this.#origin[2]) / this.cellM;
    const within = i >= 0 && i < this.#count[0] && j >= 0 && j < this.#count[1] && k >= 0 && k < this.#count[2];
    return within ? this.#index(Math.floor(i), Math.floor(j), Math.floor(k)) : -1;
  }

  #layOut(groom: Groom): boolean {
    const low = [Infinity, Infinity, Infinity];
    const high = [-Infinity, -Infinity, -Infinity];
    const extend = (begin: number, end: number) => {
      for (let p = begin; p < end; ++p)
        for (let axis = 0; axis < 3; ++axis) {
          low[axis] = Math.min(low[axis], groom.points[3 * p + axis]);
          high[axis] = Math.max(high[axis], groom.points[3 * p + axis]);
        }
    };
    extend(0, groom.strands.begin[groom.strands.count]);
    for (const card of groom.cards) extend(card.points.begin, card.points.end);
    if (!(low[0] <= high[0])) return false;
    // Computed in floats like C++: the longest side has exactly kCellsAcross cells, so rounding decides whether the last counts.
    const size = [0, 1, 2].map((axis) => Math.fround(high[axis] - low[axis]));
    this.cellM = Math.fround(Math.max(Math.max(...size) / kCellsAcross, kCellMinM));
    for (let axis = 0; axis < 3; ++axis) {
      this.#origin[axis] = low[axis] - kMargin * this.cellM - kBetweenPointsM;
      this.#count[axis] = Math.min(Math.floor(Math.fround(size[axis] / this.cellM)), kCellsAcross) + 1 + 2 * kMargin;
    }
    return true;
  }

  #addHair(groom: Groom, widthM: number): void {
    const { strands, points } = groom;
    const perM = (kHairShare * 0.75 * widthM) / (this.cellM * this.cellM);
    for (let s = 0; s < strands.count; ++s) {
      const begin = strands.begin[s];
      const end = strands.begin[s + 1];
      for (let i = begin + 1; i < end; ++i) {
        // A long segment crosses more than one cell.
        const at = 3 * i - 3;
        const dx = points[at + 3] - points[at];
        const dy = points[at + 4] - points[at + 1];
        const dz = points[at + 5] - points[at + 2];
        const length = Math.sqrt(dx * dx + dy * dy + dz * dz);
        const pieces = Math.min(Math.max(Math.ceil(length / this.cellM), 1), 64);
        for (let piece = 0; piece < pieces; ++piece) {
          const t = (piece + 0.5) / pieces;
          const cell = this.#find(points[at] + t * dx, points[at + 1] + t * dy, points[at + 2] + t * dz);
          if (cell >= 0) this.#extinction[cell] += (length / pieces) * perM;
        }
      }
    }
  }

  // A card gives the shade of the hair that it replaces. Cloth and threads are thin compared with hair and are left out.
  #addCards(groom: Groom): void {
    const { points } = groom;
    const distance = (a: number, b: number) =>
      Math.hypot(points[a] - points[b], points[a + 1] - points[b + 1], points[a + 2] - points[b + 2]);
    for (const card of groom.cards) {
      for (let p = card.points.begin; p + 3 < card.points.end; p += 2) {
        const at = 3 * p;
        const middle = (axis: number) =>
          0.25 * (points[at + axis] + points[at + 3 + axis] + points[at + 6 + axis] + points[at + 9 + axis]);
        const width = Math.min(distance(at, at + 3), 4 * this.cellM);
        const length = Math.min(distance(at, at + 6), 4 * this.cellM);
        const cell = this.#find(middle(0), middle(1), middle(2));
        if (cell < 0) continue;
        this.#extinction[cell] += (kHairShare * width * length) / (this.cellM * this.cellM);
      }
    }
  }

  #addBody(vertices: Float32Array, triangles: Uint32Array): void {
    const solid = new Uint8Array(this.#extinction.length);
    for (let t = 0; t + 2 < triangles.length; t += 3) {
      const a = 3 * triangles[t];
      const b = 3 * triangles[t + 1];
      const c = 3 * triangles[t + 2];
      const distance = (p: number, q: number) =>
        Math.hypot(vertices[p] - vertices[q], vertices[p + 1] - vertices[q + 1], vertices[p + 2] - vertices[q + 2]);
      const longest = Math.max(distance(a, b), distance(b, c), distance(a, c));
      const steps = Math.min(Math.max(Math.ceil(longest / this.cellM), 1), 24);
      for (let i = 0; i <= steps; ++i)
        for (let j = 0; i + j <= steps; ++j) {
          const u = i / steps;
          const v = j / steps;
          const w = 1 - u - v;
          const cell = this.#find(
            w * vertices[a] + u * vertices[b] + v * vertices[c],
            w * vertices[a + 1] + u * vertices[b + 1] + v * vertices[c + 1],
            w * vertices[a + 2] + u * vertices[b + 2] + v * vertices[c + 2],
          );
          if (cell >= 0) solid[cell] = 1;
        }
    }
    for (let i = 0; i < solid.length; ++i) if (solid[i]) this.#extinction[i] += kBodyExtinction;
  }

  // Light comes along the reversed ray: from the far side of the grid inwards, each cell adds its optical depth.
  #sweep(ray: number): void {
    const [nx, ny, nz] = this.#count;
    const towards = kRays[ray];
    const depth = new Float32Array(this.#extinction.length);
    const step = Math.hypot(...towards);
    const order = (axis: number, i: number) => (towards[axis] > 0 ? this.#count[axis] - 1 - i : i);
    for (let k = 0; k < nz; ++k) {
      const z = order(2, k);
      const zNext = z + towards[2];
      for (let j = 0; j < ny; ++j) {
        const y = order(1, j);
        const yNext = y + towards[1];
        for (let i = 0; i < nx; ++i) {
          const x = order(0, i);
          const xNext = x + towards[0];
          const here = this.#index(x, y, z);
          if (xNext >= 0 && xNext < nx && yNext >= 0 && yNext < ny && zNext >= 0 && zNext < nz) {
            const next = this.#index(xNext, yNext, zNext);
            depth[here] = depth[next] + step * this.#extinction[next];
          }
          this.#transmittance[kRayCount * here + ray] = Math.exp(-depth[here]);
        }
      }
    }
  }
}

function facing(normal: readonly number[], ray: number): number {
  const [x, y, z] = kRays[ray];
  return Math.max((normal[0] * x + normal[1] * y + normal[2] * z) / Math.hypot(x, y, z), 0.02);
}
