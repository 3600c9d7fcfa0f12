import {
  ClampToEdgeWrapping,
  DataUtils,
  Data3DTexture,
  HalfFloatType,
  LinearFilter,
  Matrix4,
  Quaternion,
  RGBAFormat,
  Vector3,
} from "three";
import type { MovedLattice } from "../hair/movedLattice";
import type { Pose } from "../hair/pose";

/** Characters whose motion is known to a picture; the largest on the screen. The same number as in accumulate.frag. */
export const kMovingMax = 8;
/** Nodes on each axis of a character's swing. The same number as in accumulate.frag. */
const kSwingNodes = 8;

/** A drawn character. */
export interface MovingCharacter {
  /** the same object in every picture */
  readonly character: object;
  /** scene */
  readonly pose: Pose;
  readonly size: number;
  /** of a ball about its head that contains its hair, head space, m */
  readonly ballRadiusM: number;
  /** of its head over the screen's height */
  readonly screenHeight: number;
  readonly lattice: MovedLattice | null;
}

interface Before {
  readonly headToScene: Matrix4;
  readonly lattice: MovedLattice | null;
}

/** The motion of one character's hair since the last picture. */
export interface Motion {
  /** head space -> scene */
  readonly headToScene: Matrix4;
  readonly headToSceneBefore: Matrix4;
  readonly ballRadiusM: number;
}

/** Where hair was in the last picture, for every place where it is now. */
export class HairMotion {
  /** Slices of kSwingNodes^3 texels, one for each motion: where hair was, minus where it is, head space, m. */
  readonly swing: Data3DTexture;
  readonly #values = new Uint16Array(4 * kSwingNodes ** 3 * kMovingMax);
  #shown: readonly MovingCharacter[] = [];
  #before = new Map<object, Before>();

  constructor() {
    this.swing = new Data3DTexture(this.#values, kSwingNodes, kSwingNodes, kSwingNodes * kMovingMax);
    this.swing.format = RGBAFormat;
    this.swing.type = HalfFloatType;
    this.swing.minFilter = this.swing.magFilter = LinearFilter;
    this.swing.wrapS = this.swing.wrapT = this.swing.wrapR = ClampToEdgeWrapping;
  }

  /** The characters of this picture. */
  set shown(shown: readonly MovingCharacter[]) {
    this.#shown = shown;
  }

  /** Returns the motions since `remember`, and writes `swing`. */
  motions(): Motion[] {
    const motions: Motion[] = [];
    for (const one of this.#largest()) {
      const before = this.#before.get(one.character);
      if (!before) continue;
      if (motions.length === kMovingMax) break;
      this.#writeSwing(motions.length, one, before.lattice);
      motions.push({
        headToScene: headToScene(one),
        headToSceneBefore: before.headToScene,
        ballRadiusM: one.ballRadiusM,
      });
    }
    if (motions.length > 0) this.swing.needsUpdate = true;
    return motions;
  }

  /** The state of this picture is the one before the next picture's: of the largest, whose motion will count. */
  remember(): void {
    const known = this.#before;
    this.#before = new Map();
    for (const one of this.#largest().slice(0, kMovingMax)) {
      const lattice = copied(one.lattice, known.get(one.character)?.lattice ?? null);
      this.#before.set(one.character, { headToScene: headToScene(one), lattice });
    }
  }

  forget(): void {
    this.#before.clear();
  }

  dispose(): void {
    this.swing.dispose();
  }

  #largest(): MovingCharacter[] {
    return [...this.#shown].sort((a, b) => b.screenHeight - a.screenHeight);
  }

  #writeSwing(slice: number, one: MovingCharacter, before: MovedLattice | null): void {
    let at = 4 * kSwingNodes ** 3 * slice;
    const place = (n: number) => ((2 * n) / (kSwingNodes - 1) - 1) * one.ballRadiusM;
    const now = new Float64Array(3);
    const then = new Float64Array(3);
    for (let k = 0; k < kSwingNodes; ++k) {
      for (let j = 0; j < kSwingNodes; ++j) {
        for (let i = 0; i < kSwingNodes; ++i, at += 4) {
          const x = place(i);
          const y = place(j);
          const z = place(k);
          // About the place at rest: rest + displacement(rest) = place.
          displacementAt(one.lattice, x, y, z, now);
          const rest = [x - now[0], y - now[1], z - now[2]] as const;
          displacementAt(one.lattice, ...rest, now);
          displacementAt(before, ...rest, then);
          for (let axis = 0; axis < 3; ++axis) this.#values[at + axis] = DataUtils.toHalfFloat(then[axis] - now[axis]);
        }
      }
    }
  }
}

function headToScene({ pose, size }: MovingCharacter): Matrix4 {
  return new Matrix4().compose(
    new Vector3(pose[4], pose[5], pose[6]),
    new Quaternion(pose[0], pose[1], pose[2], pose[3]),
    new Vector3(size, size, size),
  );
}

// Reuses the array of an earlier copy.
function copied(lattice: MovedLattice | null, into: MovedLattice | null): MovedLattice | null {
  if (!lattice) return null;
  const { grid } = lattice;
  const copy = into?.grid.length === grid.length ? into.grid : new Float32Array(grid.length);
  copy.set(grid);
  return { lattice: lattice.lattice, grid: copy };
}

/** The hair's displacement by linear FFD at a place at rest; beyond the lattice it is that of its border. */
export function displacementAt(
  lattice: MovedLattice | null,
  x: number,
  y: number,
  z: number,
  out: Float64Array,
): Float64Array {
  out.fill(0);
  if (!lattice) return out;
  const { grid } = lattice;
  const { origin, spacing, dims } = lattice.lattice;
  const gx = Math.min(Math.max((x - origin[0]) / spacing[0], 0), dims[0] - 1);
  const gy = Math.min(Math.max((y - origin[1]) / spacing[1], 0), dims[1] - 1);
  const gz = Math.min(Math.max((z - origin[2]) / spacing[2], 0), dims[2] - 1);
  const i = Math.min(Math.floor(gx), dims[0] - 2);
  const j = Math.min(Math.floor(gy), dims[1] - 2);
  const k = Math.min(Math.floor(gz), dims[2] - 2);
  for (let corner = 0; corner < 8; ++corner) {
    const a = corner & 1;
    const b = (corner >> 1) & 1;
    const c = corner >> 2;
    const share = (a ? gx - i : 1 - gx + i) * (b ? gy - j : 1 - gy + j) * (c ? gz - k : 1 - gz + k);
    const node = 3 * (i + a + dims[0] * (j + b + dims[1] * (k + c)));
    out[0] += share * grid[node];
    out[1] += share * grid[node + 1];
    out[2] += share * grid[node + 2];
  }
  return out;
}
