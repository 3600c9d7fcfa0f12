import { DataTexture, FloatType, RGBAFormat, type IUniform, type Texture, type WebGLRenderer } from "three";
import { kCoefficientMaxM, kLatticeRow, kNodesAreThere } from "../generated/constants";
import { nodeCount, type Basis, type Lattice, type MovedLattice, type MovedModes } from "../hair/movedLattice";
import type { PlacedLattice } from "./characterRecords";
import { FloatTexture } from "./floatTexture";
import type { NodeSum } from "./nodeSum";
import { bitsTarget, drawAside, Pass, readBits } from "./pass";

/** The records, from `first` to `last`, whose lattices have one source. */
interface Source {
  first: number;
  last: number;
  /** null: nodes are uploaded */
  readonly modes: DataTexture | null;
}

/** The rows of a lattice's nodes, and what they are the sum of. */
interface Nodes {
  readonly firstRow: number;
  readonly rowCount: number;
  /** null: it is not known */
  basis: Basis | null;
  coefficients: Float32Array;
  /** from the picture before */
  isThere: boolean;
}

/**
 * Writes the nodes of all lattices of a picture into one texture, which ffd.glsl reads. The GPU sums modes up: a basis
 * lies there once for all characters, and a character costs the upload of its coefficients, in its record. Nodes of
 * lattices without modes, and all that the processor sums up, are uploaded. Each lattice has rows of its own, which
 * stay from picture to picture, so that hair that sleeps costs nothing.
 */
export class LatticePass {
  readonly #nodes = bitsTarget(kLatticeRow);
  readonly #uploaded = new FloatTexture(kLatticeRow);
  readonly #bases = new Map<Basis, DataTexture>();
  /** of this picture; the first is that of uploaded nodes, the others have the numbers of bases */
  readonly #sources: Source[] = [];
  readonly #numbers = new Map<Basis, number>();
  /** of the lattices of this picture */
  #lattices: readonly (MovedLattice | null)[] = [];
  #rows: Nodes[] = [];
  #sum: NodeSum = "gpu";
  #rowsMax = 0;
  #uploadedRows = 0;
  readonly #uniforms: Record<string, IUniform>;
  readonly #summing: Pass;
  readonly #copying: Pass;

  constructor(records: Texture) {
    this.#uniforms = {
      records: { value: records },
      uploaded_nodes: { value: this.#uploaded.texture },
      modes: { value: null },
      first_record: { value: 0 },
      target_rows: { value: 1 },
      basis: { value: 0 },
    };
    this.#summing = new Pass("nodes.vert", "mode_nodes.frag", this.#uniforms);
    this.#copying = new Pass("nodes.vert", "uploaded_nodes.frag", this.#uniforms);
  }

  /** The nodes of all lattices: displacements, as the bits of floats. */
  get texture(): Texture {
    return this.#nodes.texture;
  }

  /** The nodes that are uploaded: 4 numbers each, in rows of kLatticeRow. */
  get uploadedNodes(): Float32Array {
    return this.#uploaded.values;
  }

  /** GPU memory of the bases. */
  get basisBytes(): number {
    let bytes = 0;
    for (const { image } of this.#bases.values()) bytes += (image.data as Float32Array).byteLength;
    return bytes;
  }

  /**
   * Begins a picture. `lattices`: of all characters, also of those that are not drawn: their bases and nodes stay on
   * the GPU. `rowsMax`: of a texture.
   */
  begin(lattices: readonly (MovedLattice | null)[], rowsMax: number, sum: NodeSum = "gpu"): void {
    this.#lattices = lattices;
    this.#rowsMax = rowsMax;
    this.#sum = sum;
    this.#placeRows();
    const bases = new Set<Basis>();
    let uploaded = 0;
    for (const [number, nodes] of this.#rows.entries()) {
      const lattice = lattices[number];
      const modes = lattice?.modes;
      nodes.isThere = modes !== undefined && modes.basis === nodes.basis && isSame(modes, nodes);
      if (lattice && this.#isSummed(lattice)) bases.add(modes!.basis);
      else if (!nodes.isThere) uploaded += nodes.rowCount;
    }
    for (const [basis, texture] of this.#bases) {
      if (bases.has(basis)) continue;
      texture.dispose();
      this.#bases.delete(basis);
    }
    this.#uploaded.reserve(Math.max(uploaded, 1));
    this.#sources.splice(0, Infinity, { first: Infinity, last: -1, modes: null });
    this.#numbers.clear();
    this.#uploadedRows = 0;
  }

  /** The GPU has lost all nodes. */
  forget(): void {
    for (const nodes of this.#rows) nodes.basis = null;
  }

  /** The place of a lattice, by its number in `begin`, for a record; null if it is not finite, or for lack of room. */
  add(number: number, record: number): PlacedLattice | null {
    const lattice = this.#lattices[number];
    const nodes = this.#rows[number];
    if (!lattice || nodes.firstRow + nodes.rowCount > this.#rowsMax) return null;
    const placed = nodes.isThere ? kThere : this.#fill(lattice, nodes);
    if (!placed) return null;
    if (!nodes.isThere) {
      const source = this.#sources[placed.basis];
      source.first = Math.min(source.first, record);
      source.last = record;
    }
    return { ...lattice.lattice, firstNode: kLatticeRow * nodes.firstRow, ...placed };
  }

  /** As `drawAside`. Records must have been written. */
  run(renderer: WebGLRenderer): void {
    if (this.#uploadedRows > 0) this.#uploaded.write();
    drawAside(renderer, () => {
      renderer.setRenderTarget(this.#nodes); // Shaders need the texture also where it has nothing.
      for (const [basis, { first, last, modes }] of this.#sources.entries()) {
        if (last < first) continue;
        this.#uniforms.first_record.value = first;
        this.#uniforms.basis.value = basis;
        this.#uniforms.modes.value = modes;
        (modes ? this.#summing : this.#copying).draw(renderer, 6, last + 1 - first);
      }
    });
  }

  /** The nodes from a row on, 4 numbers each, as the GPU has them. For tests. */
  read(renderer: WebGLRenderer, row: number, nodes: number): Float32Array {
    return readBits(renderer, this.#nodes, row, nodes);
  }

  dispose(): void {
    this.#nodes.dispose();
    this.#uploaded.dispose();
    for (const texture of this.#bases.values()) texture.dispose();
    this.#bases.clear();
    this.#summing.dispose();
    this.#copying.dispose();
  }

  /** Rows move when lattices before theirs come, leave or become larger. */
  #placeRows(): void {
    let row = 0;
    this.#rows = this.#lattices.map((lattice, number) => {
      const rowCount = lattice ? rowsOf(lattice.lattice) : 0;
      const firstRow = row;
      row += rowCount;
      const before = this.#rows[number];
      if (before?.firstRow === firstRow && before.rowCount === rowCount) return before;
      return { firstRow, rowCount, basis: null, coefficients: kNone, isThere: false };
    });
    const wanted = Math.max(Math.min(row, this.#rowsMax), 1);
    const { height } = this.#nodes;
    if (wanted <= height && height <= Math.max(4 * wanted, 8)) return;
    this.#nodes.setSize(kLatticeRow, wanted);
    this.#uniforms.target_rows.value = wanted;
    this.forget();
  }

  /** The processor sums up a basis that is too large for a texture. */
  #isSummed({ lattice, modes }: MovedLattice): boolean {
    // The texels of a basis have the modes in fours.
    return (
      this.#sum === "gpu" && !!modes && 4 * Math.ceil(modes.basis.modeCount / 4) * rowsOf(lattice) <= this.#rowsMax
    );
  }

  #fill(lattice: MovedLattice, nodes: Nodes): PlacedNodes | null {
    const { modes } = lattice;
    nodes.basis = null;
    let count = 0;
    if (modes) {
      const { coefficients } = modes;
      for (let k = 0; k < coefficients.length; ++k) {
        if (!(Math.abs(coefficients[k]) <= kCoefficientMaxM)) return null;
        if (coefficients[k] !== 0) count = k + 1;
      }
      nodes.basis = modes.basis;
      nodes.coefficients = coefficients.slice(0, count);
    }
    if (!this.#isSummed(lattice)) return this.#upload(lattice.grid, nodes.rowCount);
    return { basis: this.#numberOf(modes!.basis), coefficients: nodes.coefficients, uploadedRow: 0 };
  }

  #numberOf(basis: Basis): number {
    const known = this.#numbers.get(basis);
    if (known !== undefined) return known;
    let modes = this.#bases.get(basis);
    if (!modes) {
      const texels = basis.texels();
      modes = new DataTexture(texels, kLatticeRow, texels.length / 4 / kLatticeRow, RGBAFormat, FloatType);
      modes.needsUpdate = true;
      this.#bases.set(basis, modes);
    }
    this.#numbers.set(basis, this.#sources.length);
    return this.#sources.push({ first: Infinity, last: -1, modes }) - 1;
  }

  #upload(grid: Float32Array, rows: number): PlacedNodes | null {
    const { values } = this.#uploaded;
    const first = kLatticeRow * this.#uploadedRows;
    let unsound = 0; // or not a number
    for (let node = 0; node < grid.length / 3; ++node) {
      const at = 4 * (first + node);
      values[at] = grid[3 * node];
      values[at + 1] = grid[3 * node + 1];
      values[at + 2] = grid[3 * node + 2];
      unsound += 0 * (values[at] + values[at + 1] + values[at + 2]);
    }
    if (unsound !== 0) return null;
    this.#uploadedRows += rows;
    return { basis: 0, coefficients: kNone, uploadedRow: first / kLatticeRow };
  }
}

type PlacedNodes = Pick<PlacedLattice, "basis" | "coefficients" | "uploadedRow">;

const kNone = new Float32Array(0);
const kThere: PlacedNodes = { basis: kNodesAreThere, coefficients: kNone, uploadedRow: 0 };

/** of nodes in a texture */
function rowsOf(lattice: Lattice): number {
  return Math.ceil(nodeCount(lattice) / kLatticeRow);
}

function isSame({ coefficients }: MovedModes, nodes: Nodes): boolean {
  const { length } = nodes.coefficients;
  for (let k = 0; k < coefficients.length; ++k)
    if (coefficients[k] !== (k < length ? nodes.coefficients[k] : 0)) return false;
  return length <= coefficients.length;
}
