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
  /** The bones, scene space. */
  readonly pose: Pose;
  /** The scale of the character: 1 is the size of its groom. A negative scale mirrors in each bone, before the pose. */
  readonly size: number;
  /** The colour of the hair at its root. */
  readonly hair: Color;
  readonly hairTip: Color;
  readonly skin: Color;
  /** The roughness of the hair, 0 to 1. */
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

/** What records need of the strands of a groom at rest. Lengths are in m, and boxes in head space. */
export interface RestingStrands {
  readonly strandCount: number;
  readonly strandWidthM: number;
  /** The boxes that contain the strands' points, and their roots. */
  readonly strandBox: Box3;
  readonly rootBox: Box3;
}

/** What the nodes of some records are made of; `hairnet_source` of client/hairnet.h. */
export interface NodeSource {
  /** The picture's number of the basis whose modes the GPU sums up; 0: the nodes are uploaded. */
  readonly basis: number;
  /** A hairnet_scene and the index of one of its characters, which has this basis. */
  readonly scene: number;
  readonly index: number;
  /** The records from `first` to before `end` have nodes of this source. */
  readonly first: number;
  readonly end: number;
}

/** What the GPU gets beside records; `hairnet_picture_data` of client/hairnet.h. */
export interface PictureData {
  readonly module: Instance;
  /** The address of the uploaded nodes in the module's memory, and the count of their rows of kLatticeRow nodes. */
  readonly nodes: number;
  readonly uploadedRows: number;
  /** The height that the texture of all nodes must have. A texture of another height has lost its nodes. */
  readonly nodeRows: number;
  readonly sources: readonly NodeSource[];
  /** How many characters have light that follows their hair. */
  readonly lightGrids: number;
}

/** The sizes of hairnet_picture_data and hairnet_source in the module: eight and five fields of 4 bytes. */
const kDataBytes = 32;
const kSourceBytes = 20;

/** The records of all characters of a picture, one row each, as the module writes them (`hairnet_picture`). */
export class Records {
  readonly #rows = new FloatTexture(kRecordTexels);
  /** What the records have in the module of the last picture. */
  #made: Made | null = null;
  /** How many characters the last `begin` had. */
  #count = 0;

  get texture() {
    return this.#rows.texture;
  }

  /**
   * Begins a picture of these characters, also of those that are not drawn: the GPU keeps the bases and nodes of all of
   * them. `module` writes the picture; lattices of another module are copied into its memory.
   */
  begin(module: Instance, characters: readonly { readonly lattice: MovedLattice | null }[]): void {
    if (this.#made?.module !== module) {
      this.#free();
      this.#made = new Made(module);
    }
    this.#count = characters.length;
    this.#made.place(characters);
  }

  /** Says how large the head of the character `number` is, for `chooseDetails`. */
  measure(number: number, headPx: number, strandCount: number): void {
    const { module, drawn } = this.#made!;
    const at = drawn.at + kDrawnBytes * number;
    module.floatMemory()[(at + At.headPx) / 4] = headPx;
    module.wordMemory()[(at + At.strandCount) / 4] = strandCount;
  }

  /** Chooses the detail of every character by its measured size. `quality` multiplies the sizes. */
  chooseDetails(quality: number): void {
    const { module, drawn } = this.#made!;
    module.call("hairnet_choose_details", drawn.at, this.#count, quality);
  }

  /** Reads into `detail` what `chooseDetails` has chosen for the character. */
  readDetail(number: number, detail: DrawDetail): void {
    const { module, drawn } = this.#made!;
    readDetail(module, drawn.at + kDrawnBytes * number, detail);
  }

  /**
   * Says that the character is drawn, and how. `number`: its index in the list of `begin`; `row`: the row of its
   * record.
   */
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

  /**
   * Ends the picture: writes the records into `texture`, and returns what the GPU gets beside them. `sum`: who sums up
   * modes; `rowsMax`: the most rows that a texture of this device can have.
   */
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

/** The size of hairnet_motions in the module: two addresses and a count. */
const kMotionsBytes = 12;

/** The picture and the memory that the records have in one module. */
class Made {
  readonly picture: number;
  /** The hairnet_drawn of all characters, one behind the other. */
  readonly drawn: Block;
  /** The nodes of lattices that are not the module's own. */
  readonly #nodes: Block;

  constructor(readonly module: Instance) {
    this.picture = module.make("hairnet_picture_make");
    this.drawn = new Block(module);
    this.#nodes = new Block(module);
  }

  /** Resets the hairnet_drawn of all characters to "not drawn", with the lattices that move their hair. */
  place(characters: readonly { readonly lattice: MovedLattice | null }[]): void {
    const { module } = this;
    // A block loses its contents when it grows, so it first gets the size for all copies.
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

  /** Whether this module has the lattice itself, so that its nodes need no copy. */
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
