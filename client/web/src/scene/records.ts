import type { Box3, Color } from "three";
import { kRecordTexels } from "../generated/constants";
import { nodeCount, type MovedLattice } from "../hair/movedLattice";
import type { Pose } from "../hair/pose";
import { Block } from "../module/block";
import type { Instance } from "../module/instance";
import { At, kDrawnBytes, kNotDrawn } from "./drawn";
import { readDetail, type DrawDetail } from "./drawDetail";
import { FloatTexture } from "./floatTexture";
import type { NodeSum } from "./nodeSum";

/** A character that is drawn. Its numbers are finite. */
export interface CharacterRecord {
  /** scene */
  readonly pose: Pose;
  /** The scale of the character: 1 is the size of its groom. A negative scale mirrors in each bone, before the pose. */
  readonly size: number;
  /** at the root */
  readonly hair: Color;
  readonly hairTip: Color;
  readonly skin: Color;
  /** of the hair, 0 to 1 */
  readonly roughness: number;
  readonly bodyVisible: boolean;
  readonly strands: RestingStrands;
  readonly detail: DrawDetail;
  /** The first row in the texture of `StrandDeformPass` that has the points of its strands. */
  readonly firstRow: number;
  readonly rowCount: number;
  /** Light may be followed through its moving hair: it is, for large ones of the first kDensityGridsMax characters. */
  readonly hasLight: boolean;
  /** A number that stays the same in every frame, by which its motion is followed; 0: it is not followed. */
  readonly id: number;
  /** The radius of a ball about its head that contains its hair, head space, m. */
  readonly ballRadiusM: number;
}

/** Of a groom, in head space, m. */
export interface RestingStrands {
  readonly strandCount: number;
  readonly strandWidthM: number;
  /** contain the strands' points, and their roots */
  readonly strandBox: Box3;
  readonly rootBox: Box3;
}

/** `hairnet_source` of client/hairnet.h. */
export interface NodeSource {
  /** 0: nodes are uploaded */
  readonly basis: number;
  readonly scene: number;
  readonly index: number;
  /** records from `first` to before `end` */
  readonly first: number;
  readonly end: number;
}

/** What the GPU gets beside records. */
export interface PictureData {
  readonly module: Instance;
  /** where rows of uploaded nodes are in its memory */
  readonly nodes: number;
  readonly uploadedRows: number;
  /** of the texture of nodes; of another height it is empty */
  readonly nodeRows: number;
  readonly sources: readonly NodeSource[];
  readonly lightGrids: number;
}

const kDataBytes = 32;
const kSourceBytes = 20;

/** The records of all characters of a picture, one row each, as the module writes them (`hairnet_picture`). */
export class Records {
  readonly #rows = new FloatTexture(kRecordTexels);
  #made: Made | null = null;
  #count = 0;

  get texture() {
    return this.#rows.texture;
  }

  /**
   * Begins a picture of these characters, also of those that are not drawn: their bases and nodes stay on the GPU. In
   * the memory of `module`; lattices that are another one's are copied.
   */
  begin(module: Instance, characters: readonly { readonly lattice: MovedLattice | null }[]): void {
    if (this.#made?.module !== module) {
      this.#free();
      this.#made = new Made(module);
    }
    this.#count = characters.length;
    this.#made.place(characters);
  }

  /** How large a head is, for its detail. */
  measure(number: number, headPx: number, strandCount: number): void {
    const { module, drawn } = this.#made!;
    const at = drawn.at + kDrawnBytes * number;
    module.floatMemory()[(at + At.headPx) / 4] = headPx;
    module.wordMemory()[(at + At.strandCount) / 4] = strandCount;
  }

  chooseDetails(quality: number): void {
    const { module, drawn } = this.#made!;
    module.call("hairnet_choose_details", drawn.at, this.#count, quality);
  }

  readDetail(number: number, detail: DrawDetail): void {
    const { module, drawn } = this.#made!;
    readDetail(module, drawn.at + kDrawnBytes * number, detail);
  }

  /** `number`: of the character in `begin`; `row`: of its record. */
  put(number: number, row: number, record: CharacterRecord): void {
    const { module, drawn } = this.#made!;
    const at = drawn.at + kDrawnBytes * number;
    const floats = module.floatMemory();
    const words = module.wordMemory();
    const { strands, detail } = record;
    module.doubleMemory().set(record.pose, (at + At.pose) / 8);
    words[(at + At.id) / 4] = record.id;
    words[(at + At.record) / 4] = row;
    floats[(at + At.scale) / 4] = record.size;
    record.hair.toArray(floats as unknown as number[], (at + At.hair) / 4);
    record.hairTip.toArray(floats as unknown as number[], (at + At.hairTip) / 4);
    record.skin.toArray(floats as unknown as number[], (at + At.skin) / 4);
    floats[(at + At.roughness) / 4] = record.roughness;
    words[(at + At.hidesBody) / 4] = record.bodyVisible ? 0 : 1;
    words[(at + At.strandCount) / 4] = strands.strandCount;
    floats[(at + At.strandWidth) / 4] = strands.strandWidthM;
    floats[(at + At.detail) / 4] = detail.strandShare;
    floats[(at + At.detail) / 4 + 1] = detail.followHairCount;
    floats[(at + At.detail) / 4 + 2] = detail.toleranceM;
    floats[(at + At.detail) / 4 + 3] = detail.quadratic;
    words[(at + At.firstRow) / 4] = record.firstRow;
    words[(at + At.rowCount) / 4] = record.rowCount;
    words[(at + At.hasLight) / 4] = record.hasLight && strands.strandCount > 0 ? 1 : 0;
    putBox(floats, (at + At.box) / 4, strands.strandBox);
    putBox(floats, (at + At.rootBox) / 4, strands.rootBox);
    floats[(at + At.ballRadius) / 4] = record.ballRadiusM;
  }

  /** Ends the picture. `rowsMax`: of a texture. */
  write(sum: NodeSum, rowsMax: number): PictureData {
    const { module, picture, drawn } = this.#made!;
    const data = module.struct(kDataBytes, (at) =>
      module.demand("hairnet_picture_write", picture, drawn.at, this.#count, sum, rowsMax, at),
    );
    const [records, recordCount, nodes, uploadedRows, nodeRows, sources, sourceCount, lightGrids] = Array.from(
      { length: kDataBytes / 4 },
      (_, i) => data.getUint32(4 * i, true),
    );
    this.#rows.reserve(Math.max(recordCount, 1));
    this.#rows.values.set(module.floats(records, 4 * kRecordTexels * recordCount));
    this.#rows.write();
    const words = module.wordMemory();
    return {
      module,
      nodes,
      uploadedRows,
      nodeRows,
      sources: Array.from({ length: sourceCount }, (_, n) => {
        const at = (sources + kSourceBytes * n) / 4;
        const [basis, scene, index, first, end] = words.subarray(at, at + kSourceBytes / 4);
        return { basis, scene, index, first, end };
      }),
      lightGrids,
    };
  }

  /** `hairnet_picture_motions` of the last picture: the module, and where it has written it; null: there is none. */
  motions(): { readonly module: Instance; readonly at: number } | null {
    if (!this.#made) return null;
    const { module, picture, drawn } = this.#made;
    let error = 0;
    const { byteOffset } = module.struct(kMotionsBytes, (at) => {
      error = module.call("hairnet_picture_motions", picture, drawn.at, this.#count, at);
    });
    return error === 0 ? { module, at: byteOffset } : null;
  }

  /** The GPU has lost all nodes. */
  forget(): void {
    if (this.#made) this.#made.module.call("hairnet_picture_forget", this.#made.picture);
  }

  dispose(): void {
    this.#rows.dispose();
    this.#free();
  }

  #free(): void {
    this.#made?.free();
    this.#made = null;
    this.#count = 0;
  }
}

const kMotionsBytes = 12;

/** What belongs to one module. */
class Made {
  readonly picture: number;
  /** hairnet_drawn of all characters */
  readonly drawn: Block;
  /** of lattices that are not the module's */
  readonly #nodes: Block;

  constructor(readonly module: Instance) {
    this.picture = module.make("hairnet_picture_make");
    this.drawn = new Block(module);
    this.#nodes = new Block(module);
  }

  place(characters: readonly { readonly lattice: MovedLattice | null }[]): void {
    const { module } = this;
    let floats = 0;
    for (const { lattice } of characters) if (lattice && !this.#has(lattice)) floats += lattice.grid.length;
    let nodes = this.#nodes.reserve(4 * floats);
    let at = this.drawn.reserve(kDrawnBytes * characters.length);
    for (const { lattice } of characters) {
      const words = module.wordMemory();
      words[(at + At.id) / 4] = words[(at + At.scene) / 4] = words[(at + At.nodes) / 4] = 0;
      words[(at + At.record) / 4] = kNotDrawn;
      module.floatMemory()[(at + At.headPx) / 4] = 0;
      if (lattice && this.#has(lattice)) {
        words[(at + At.scene) / 4] = lattice.shown!.scene;
        words[(at + At.index) / 4] = lattice.shown!.index;
      } else if (lattice && lattice.grid.length === 3 * nodeCount(lattice.lattice)) {
        this.#copy(lattice, at, nodes);
        nodes += 4 * lattice.grid.length;
      }
      at += kDrawnBytes;
    }
  }

  free(): void {
    this.drawn.free();
    this.#nodes.free();
    this.module.call("hairnet_picture_free", this.picture);
  }

  #has(lattice: MovedLattice): boolean {
    return lattice.shown?.module === this.module;
  }

  #copy({ grid, lattice: { origin, spacing, dims } }: MovedLattice, at: number, nodes: number): void {
    const floats = this.module.floatMemory();
    const words = this.module.wordMemory();
    floats.set(grid, nodes / 4);
    floats.set(origin, (at + At.origin) / 4);
    floats.set(spacing, (at + At.spacing) / 4);
    words.set(dims, (at + At.counts) / 4);
    words[(at + At.nodes) / 4] = nodes;
  }
}

function putBox(floats: Float32Array, at: number, { min, max }: Box3): void {
  min.toArray(floats, at);
  max.toArray(floats, at + 3);
}
