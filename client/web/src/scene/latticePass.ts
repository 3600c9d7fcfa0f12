import {
  Camera,
  DataTexture,
  DoubleSide,
  GLSL3,
  InstancedBufferGeometry,
  Mesh,
  NearestFilter,
  NoBlending,
  RawShaderMaterial,
  FloatType,
  RGBAFormat,
  RGBAIntegerFormat,
  UnsignedIntType,
  WebGLRenderTarget,
  type IUniform,
  type Texture,
  type WebGLRenderer,
} from "three";
import { kCoefficientMaxM, kLatticeRow } from "../generated/constants";
import type { Basis } from "../hair/basis";
import type { LevelGeometry } from "../hair/lattice";
import type { MovedLattice, MovedModes } from "../hair/movedLattice";
import type { PlacedLattice } from "./characterRecords";
import { FloatTexture } from "./floatTexture";
import { modeRows, modeTexels, nodeRows } from "./modeTexels";
import { shader } from "./shaders";

/** The records, from `first` to `last`, whose lattices have one source. */
interface Source {
  first: number;
  last: number;
  /** null: nodes are uploaded */
  readonly modes: DataTexture | null;
}

/**
 * Writes the nodes of all lattices of a picture into one texture, which ffd.glsl reads. The GPU sums modes up: a basis
 * lies there once for all characters, and a character costs the upload of its coefficients, in its record. Nodes of
 * lattices without modes are uploaded. Each lattice has rows of its own.
 */
export class LatticePass {
  readonly #nodes = new WebGLRenderTarget(kLatticeRow, 1, {
    format: RGBAIntegerFormat,
    type: UnsignedIntType,
    internalFormat: "RGBA32UI",
    minFilter: NearestFilter,
    magFilter: NearestFilter,
    generateMipmaps: false,
    depthBuffer: false,
  });
  readonly #uploaded = new FloatTexture(kLatticeRow);
  readonly #bases = new Map<Basis, DataTexture>();
  /** of this picture; the first is that of uploaded nodes, the others have the numbers of bases */
  readonly #sources: Source[] = [];
  readonly #numbers = new Map<Basis, number>();
  #rows = 0;
  #rowsMax = 0;
  #uploadedRows = 0;
  readonly #uniforms: Record<string, IUniform>;
  readonly #geometry = new InstancedBufferGeometry();
  readonly #sum: Mesh<InstancedBufferGeometry, RawShaderMaterial>;
  readonly #copy: Mesh<InstancedBufferGeometry, RawShaderMaterial>;
  readonly #camera = new Camera();

  constructor(records: Texture) {
    this.#uniforms = {
      records: { value: records },
      uploaded_nodes: { value: this.#uploaded.texture },
      modes: { value: null },
      first_record: { value: 0 },
      target_rows: { value: 1 },
      basis: { value: 0 },
    };
    this.#geometry.setDrawRange(0, 6);
    this.#sum = this.#makePass("mode_nodes.frag");
    this.#copy = this.#makePass("uploaded_nodes.frag");
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
   * Begins a picture. `lattices`: of all characters, also of those that are not drawn: their bases stay on the GPU.
   * `rowsMax`: of a texture.
   */
  begin(lattices: Iterable<MovedLattice | null>, rowsMax: number): void {
    this.#rowsMax = rowsMax;
    const bases = new Set<Basis>();
    let uploaded = 0;
    for (const lattice of lattices) {
      if (lattice?.modes && this.#hasRoom(lattice.geometry, lattice.modes.basis)) bases.add(lattice.modes.basis);
      else if (lattice) uploaded += nodeRows(lattice.geometry);
    }
    for (const [basis, texture] of this.#bases) {
      if (bases.has(basis)) continue;
      texture.dispose();
      this.#bases.delete(basis);
    }
    this.#uploaded.reserve(Math.max(uploaded, 1));
    this.#sources.splice(0, Infinity, { first: Infinity, last: -1, modes: null });
    this.#numbers.clear();
    this.#rows = this.#uploadedRows = 0;
  }

  /** The place of the lattice of a record; null if it is not finite, or for lack of room. */
  add(lattice: MovedLattice, record: number): PlacedLattice | null {
    const rows = nodeRows(lattice.geometry);
    if (this.#rows + rows > this.#rowsMax) return null;
    const isSummed = lattice.modes && this.#hasRoom(lattice.geometry, lattice.modes.basis);
    const placed = isSummed ? this.#sumUp(lattice.geometry, lattice.modes!) : this.#upload(lattice.grid, rows);
    if (!placed) return null;
    const source = this.#sources[placed.basis];
    source.first = Math.min(source.first, record);
    source.last = record;
    const firstNode = kLatticeRow * this.#rows;
    this.#rows += rows;
    return { ...lattice.geometry.lattice, firstNode, ...placed };
  }

  /** Records must have been written. Do not call it while the renderer draws something else. */
  run(renderer: WebGLRenderer): void {
    const { height } = this.#nodes;
    if (this.#rows > height || height > Math.max(4 * this.#rows, 8)) {
      const wanted = Math.max(this.#rows, Math.min(Math.ceil(1.5 * this.#rows), this.#rowsMax), 1);
      this.#nodes.setSize(kLatticeRow, wanted);
      this.#uniforms.target_rows.value = wanted;
    }
    if (this.#uploadedRows > 0) this.#uploaded.write();
    const before = renderer.getRenderTarget();
    const { autoClear } = renderer;
    const xr = renderer.xr.enabled;
    renderer.autoClear = renderer.xr.enabled = false;
    renderer.setRenderTarget(this.#nodes); // Shaders need the texture also where it has nothing.
    for (const [basis, { first, last, modes }] of this.#sources.entries()) {
      if (last < first) continue;
      this.#geometry.instanceCount = last + 1 - first;
      this.#uniforms.first_record.value = first;
      this.#uniforms.basis.value = basis;
      this.#uniforms.modes.value = modes;
      renderer.render(modes ? this.#sum : this.#copy, this.#camera);
    }
    renderer.setRenderTarget(before);
    renderer.autoClear = autoClear;
    renderer.xr.enabled = xr;
  }

  /** The nodes from a row on, 4 numbers each, as the GPU has them. For tests. */
  read(renderer: WebGLRenderer, row: number, nodes: number): Float32Array {
    const rows = Math.ceil(nodes / kLatticeRow);
    const bits = new Uint32Array(4 * kLatticeRow * rows);
    renderer.readRenderTargetPixels(this.#nodes, 0, row, kLatticeRow, rows, bits);
    return new Float32Array(bits.buffer);
  }

  dispose(): void {
    this.#nodes.dispose();
    this.#uploaded.dispose();
    for (const texture of this.#bases.values()) texture.dispose();
    this.#bases.clear();
    this.#geometry.dispose();
    this.#sum.material.dispose();
    this.#copy.material.dispose();
  }

  #hasRoom(geometry: LevelGeometry, basis: Basis): boolean {
    return modeRows(geometry, basis) <= this.#rowsMax;
  }

  #sumUp(geometry: LevelGeometry, { basis, coefficients }: MovedModes): PlacedNodes | null {
    let count = 0;
    for (let k = 0; k < coefficients.length; ++k) {
      if (!(Math.abs(coefficients[k]) <= kCoefficientMaxM)) return null;
      if (coefficients[k] !== 0) count = k + 1;
    }
    return { basis: this.#numberOf(geometry, basis), coefficients: coefficients.subarray(0, count), uploadedRow: 0 };
  }

  #numberOf(geometry: LevelGeometry, basis: Basis): number {
    const known = this.#numbers.get(basis);
    if (known !== undefined) return known;
    let modes = this.#bases.get(basis);
    if (!modes) {
      const rows = modeRows(geometry, basis);
      modes = new DataTexture(modeTexels(geometry, basis), kLatticeRow, rows, RGBAFormat, FloatType);
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

  #makePass(fragment: string): Mesh<InstancedBufferGeometry, RawShaderMaterial> {
    const material = new RawShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: shader("nodes.vert"),
      fragmentShader: shader(fragment),
      uniforms: this.#uniforms,
      side: DoubleSide,
      depthTest: false,
      depthWrite: false,
      blending: NoBlending,
    });
    const mesh = new Mesh(this.#geometry, material);
    mesh.frustumCulled = false;
    return mesh;
  }
}

type PlacedNodes = Pick<PlacedLattice, "basis" | "coefficients" | "uploadedRow">;

const kNone = new Float32Array(0);
