import {
  kFullBlend,
  kSkinDeepestM,
  kSkinStepM,
  kSkinWaySteps,
  kSlackM,
  kSlopeSquaredMin,
  kTurns,
} from "../generated/constants";
import { HairnetError } from "./hairnetError";
import { Bone, kNumbersPerBone, type Pose } from "./pose";
import { validateSkin, type Skin, type SkinDistanceField } from "./skin";

const kStepM = Math.fround(kSkinStepM);
const kDeepestM = Math.fround(kSkinDeepestM);

/** The grid of one bone's skin. */
export interface SkinGrid extends SkinDistanceField {
  /** number of its first node among all nodes */
  readonly first: number;
}

/**
 * Pushes deformed hair out of the skin, as core/ffd/skin_push.hpp explains: a point that the skin, moved with its bone,
 * has nearer than its limit moves along the way out. Continuous in the pose and in the point; hair at rest stays as it is.
 */
export class SkinPush {
  readonly grids: readonly SkinGrid[];
  /** 4 bytes a node: the distance, and the way, 128 + kSkinWaySteps * way; 0 0 0: nothing is pushed in the cells around */
  readonly nodes: Uint8Array;
  // The distance of the last point looked up, m, and the way.
  readonly #felt = new Float64Array(4);
  readonly #at = new Float64Array(3);
  /** from head space to each grid's rest space: a rotation by rows, then a shift */
  readonly #toBone: Float64Array;

  /** `thicknessM`: of the hair. */
  constructor(
    skin: Skin,
    readonly thicknessM: number,
  ) {
    validateSkin(skin);
    let first = 0;
    this.grids = skin.map((field) => {
      const grid = { ...field, first };
      first += field.bytes.length;
      return grid;
    });
    this.nodes = new Uint8Array(4 * first);
    this.#toBone = new Float64Array(12 * skin.length);
    for (const grid of this.grids) setNodes(grid, thicknessM, this.nodes.subarray(4 * grid.first));
  }

  /** `rest`, `blend`: in the design, head space, and the root blend (null: 1); `points`: after the FFD, 3 numbers each. */
  push(pose: Pose, rest: Float32Array, blend: Float32Array | null, points: Float32Array): void {
    if (rest.length !== points.length || (blend && 3 * blend.length !== points.length))
      throw new HairnetError("invalid", "points, their places at rest and root blends are not equally many");
    for (const [g, { bone }] of this.grids.entries()) setToBone(pose, bone, this.#toBone.subarray(12 * g));
    for (let at = 0; at < points.length; at += 3) {
      const share = blend ? Math.min(1, blend[at / 3] / kFullBlend) : 1;
      for (let turn = 0, isMoved = true; turn < kTurns && isMoved; ++turn) {
        isMoved = false;
        for (let g = 0; g < this.grids.length; ++g) isMoved = this.#pushFrom(g, rest, share, points, at) || isMoved;
      }
    }
  }

  /** Returns whether it moves the point. */
  #pushFrom(g: number, rest: Float32Array, share: number, points: Float32Array, p: number): boolean {
    const grid = this.grids[g];
    const isHead = grid.bone === Bone.head;
    const m = 12 * g;
    const turn = this.#toBone;
    const at = this.#at;
    const felt = this.#felt;
    for (let a = 0; a < 3; ++a) {
      const row = m + 3 * a;
      at[a] = isHead
        ? points[p + a]
        : turn[row] * points[p] + turn[row + 1] * points[p + 1] + turn[row + 2] * points[p + 2] + turn[m + 9 + a];
    }
    if (!this.#feel(grid, at) || felt[0] >= this.thicknessM) return false;
    const [distanceM, x, y, z] = felt;
    at.set(rest.subarray(p, p + 3));
    const limitM = this.#feel(grid, at) ? Math.min(this.thicknessM, felt[0] - kSlackM) : this.thicknessM;
    const missingM = limitM - distanceM;
    if (!(missingM > 0)) return false;
    for (let a = 0; a < 3; ++a) {
      if (isHead) points[p + a] += missingM * (a === 0 ? x : a === 1 ? y : z);
      else points[p + a] += share * missingM * (turn[m + a] * x + turn[m + 3 + a] * y + turn[m + 6 + a] * z);
    }
    return true;
  }

  /** Looks up distance and way; false when the point is too far away for any limit. */
  #feel(grid: SkinGrid, at: Float64Array): boolean {
    const { origin, cellM, dims } = grid;
    const [x, tx, beyondX] = cellOf((at[0] - origin[0]) / cellM, dims[0] - 1);
    const [y, ty, beyondY] = cellOf((at[1] - origin[1]) / cellM, dims[1] - 1);
    const [z, tz, beyondZ] = cellOf((at[2] - origin[2]) / cellM, dims[2] - 1);
    const beyondM = cellM * Math.hypot(beyondX, beyondY, beyondZ);
    if (beyondM >= this.thicknessM - kDeepestM) return false;
    const base = grid.first + x + dims[0] * (y + dims[1] * z);
    if (this.nodes[4 * base + 1] === 0) return false;
    const felt = this.#felt.fill(0);
    for (let corner = 0; corner < 8; ++corner) {
      const i = corner & 1;
      const j = (corner >> 1) & 1;
      const k = corner >> 2;
      const weight = (i ? tx : 1 - tx) * (j ? ty : 1 - ty) * (k ? tz : 1 - tz);
      const node = 4 * (base + i + dims[0] * (j + dims[1] * k));
      for (let n = 0; n < 4; ++n) felt[n] += weight * this.nodes[node + n];
    }
    felt[0] = kDeepestM + kStepM * felt[0] + beyondM;
    for (let n = 1; n < 4; ++n) felt[n] = (felt[n] - 128) / kSkinWaySteps;
    return true;
  }
}

/** The lowest node of the cell, the place in it, and how far beyond the grid. */
function cellOf(at: number, cells: number): [low: number, t: number, beyond: number] {
  const within = Math.min(Math.max(at, 0), cells);
  const low = Math.min(Math.floor(within), cells - 1);
  return [low, within - low, at - within];
}

/** Ways only of nodes of cells in which points may be pushed. */
function setNodes(field: SkinDistanceField, thicknessM: number, nodes: Uint8Array): void {
  const { bytes, dims } = field;
  // Half a step more than the thickness: rounding leaves no pushed point out.
  const farByte = Math.ceil((thicknessM - kDeepestM) / kStepM + 0.5);
  const [nx, ny, nz] = dims;
  for (let node = 0; node < bytes.length; ++node) {
    nodes[4 * node] = bytes[node];
    if (bytes[node] >= farByte) continue;
    const x = node % nx;
    const y = Math.floor(node / nx) % ny;
    const z = Math.floor(node / (nx * ny));
    for (let k = Math.max(z - 1, 0); k <= Math.min(z + 1, nz - 1); ++k)
      for (let j = Math.max(y - 1, 0); j <= Math.min(y + 1, ny - 1); ++j)
        for (let i = Math.max(x - 1, 0); i <= Math.min(x + 1, nx - 1); ++i)
          if (nodes[4 * (i + nx * (j + ny * k)) + 1] === 0) setWay(field, [i, j, k], nodes);
  }
}

const slope = [0, 0, 0];

/** From central differences of the distances; one-sided at the border. */
function setWay({ bytes, dims, cellM }: SkinDistanceField, at: readonly number[], nodes: Uint8Array): void {
  const stride = [1, dims[0], dims[0] * dims[1]];
  const node = at[0] + stride[1] * at[1] + stride[2] * at[2];
  let squared = 0;
  for (let a = 0; a < 3; ++a) {
    const below = at[a] > 0 ? 1 : 0;
    const above = at[a] + 1 < dims[a] ? 1 : 0;
    const change = bytes[node + above * stride[a]] - bytes[node - below * stride[a]];
    slope[a] = (change * kStepM) / (cellM * (above + below));
    squared += slope[a] * slope[a];
  }
  const scale = kSkinWaySteps / Math.max(squared, kSlopeSquaredMin);
  for (let a = 0; a < 3; ++a) nodes[4 * node + 1 + a] = Math.floor(128.5 + scale * slope[a]);
}

/** The transform of head space to the bone's rest space: the rotation by rows, then the shift. */
function setToBone(pose: Pose, bone: Bone, out: Float64Array): void {
  const own = bone * kNumbersPerBone;
  const turn = rotationOf(pose, own);
  const head = rotationOf(pose, 0);
  for (let a = 0; a < 3; ++a) {
    out[9 + a] = 0;
    for (let n = 0; n < 3; ++n) out[9 + a] += turn[3 * n + a] * (pose[4 + n] - pose[own + 4 + n]);
    for (let b = 0; b < 3; ++b) {
      out[3 * a + b] = 0;
      for (let n = 0; n < 3; ++n) out[3 * a + b] += turn[3 * n + a] * head[3 * n + b];
    }
  }
}

/** By rows, of the quaternion at `at`. */
function rotationOf(pose: Pose, at: number): number[] {
  const [x, y, z, w] = pose.subarray(at, at + 4);
  return [
    1 - 2 * (y * y + z * z),
    2 * (x * y - w * z),
    2 * (x * z + w * y),
    2 * (x * y + w * z),
    1 - 2 * (x * x + z * z),
    2 * (y * z - w * x),
    2 * (x * z - w * y),
    2 * (y * z + w * x),
    1 - 2 * (x * x + y * y),
  ];
}
