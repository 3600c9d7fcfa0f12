import {
  kCoefficientTexel,
  kDensityTexel,
  kFirstBone,
  kLatticeTexel,
  kRecordTexels,
  kTipTexel,
} from "../generated/constants";
import type { Lattice } from "../hair/movedLattice";
import { kBoneCount, kNumbersPerBone, type Pose } from "../hair/pose";
import type { DensityGrid } from "./densityGrid";
import type { DrawDetail } from "./drawDetail";
import { FloatTexture } from "./floatTexture";

/** A lattice that moves hair, and its place in `LatticePass`. */
export interface PlacedLattice extends Lattice {
  readonly firstNode: number;
  /** number of its basis in the picture, from 1; 0: its nodes are uploaded; -1: they are there already */
  readonly basis: number;
  /** of its modes, m; none where nodes are uploaded */
  readonly coefficients: Float32Array;
  /** of uploaded nodes */
  readonly uploadedRow: number;
}

/** The data of a character in its row. */
export interface CharacterRecord {
  /** scene */
  readonly pose: Pose;
  /** at the root */
  readonly hairAlbedo: readonly [number, number, number];
  readonly hairTipAlbedo: readonly [number, number, number];
  /** of the hair, 0 to 1 */
  readonly roughness: number;
  readonly skinAlbedo: readonly [number, number, number];
  readonly widthM: number;
  readonly detail: DrawDetail;
  readonly strayM: number;
  /** its scale; 1: the size of its groom */
  readonly size: number;
  readonly bodyVisible: boolean;
  /** null: the hair is at rest */
  readonly lattice: PlacedLattice | null;
  /** rows of `StrandDeformPass` with the points of its strands */
  readonly pointRows: PointRows;
  /** null: none */
  readonly density?: DensityGrid | null;
}

export interface PointRows {
  readonly first: number;
  readonly count: number;
}

/** The records of all characters in a frame; one row each, in the order of the draw calls. */
export class CharacterRecords {
  readonly #rows = new FloatTexture(kRecordTexels);
  #count = 0;

  get texture() {
    return this.#rows.texture;
  }

  /** Number of added rows. */
  get count(): number {
    return this.#count;
  }

  /** Makes room for `count` unwritten rows. */
  begin(count: number): void {
    this.#rows.reserve(Math.max(count, 1));
    this.#count = 0;
  }

  /** Returns the row of the record. */
  add(record: CharacterRecord): number {
    writeRecord(record, this.#rows.values.subarray(4 * kRecordTexels * this.#count));
    return this.#count++;
  }

  end(): void {
    this.#rows.write();
  }

  dispose(): void {
    this.#rows.dispose();
  }
}

/** Writes it into the first kRecordTexels texels of `out`. */
export function writeRecord(record: CharacterRecord, out: Float32Array): void {
  const { pose, detail, lattice } = record;
  const put = (texel: number, a: number, b: number, c: number, d: number) => {
    out[4 * texel] = a;
    out[4 * texel + 1] = b;
    out[4 * texel + 2] = c;
    out[4 * texel + 3] = d;
  };
  put(0, pose[0], pose[1], pose[2], pose[3]);
  put(1, pose[4], pose[5], pose[6], record.pointRows.first);
  put(2, ...record.hairAlbedo, record.widthM);
  put(3, detail.strandShare, detail.quadratic, 0, 0);
  put(4, detail.followHairCount, record.strayM, lattice ? 1 : 0, record.size - 1);
  put(5, ...record.skinAlbedo, record.bodyVisible ? 0 : 1);
  for (let bone = 0; bone < kBoneCount; ++bone) {
    const at = bone * kNumbersPerBone;
    put(kFirstBone + 2 * bone, pose[at], pose[at + 1], pose[at + 2], pose[at + 3]);
    put(kFirstBone + 1 + 2 * bone, pose[at + 4], pose[at + 5], pose[at + 6], bone === 0 ? record.pointRows.count : 0);
  }
  if (record.density) {
    const { number, origin, cell, weight } = record.density;
    put(kDensityTexel, origin.x, origin.y, origin.z, number + 1);
    [cell.x, cell.y, cell.z, weight].forEach((value, n) => {
      out[4 * (kFirstBone + 3 + 2 * n) + 3] = value;
    });
  } else put(kDensityTexel, 0, 0, 0, 0);
  if (lattice) {
    const { origin, spacing, dims, firstNode, basis, coefficients } = lattice;
    put(kLatticeTexel, origin[0], origin[1], origin[2], basis);
    put(kLatticeTexel + 1, 1 / spacing[0], 1 / spacing[1], 1 / spacing[2], firstNode);
    put(kLatticeTexel + 2, dims[0], dims[1], dims[2], basis > 0 ? coefficients.length : lattice.uploadedRow);
    out.fill(0, 4 * kCoefficientTexel, 4 * kRecordTexels);
    out.set(coefficients, 4 * kCoefficientTexel);
  }
  put(kTipTexel, ...record.hairTipAlbedo, record.roughness);
}
