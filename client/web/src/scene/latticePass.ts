import { DataTexture, FloatType, RGBAFormat, type IUniform, type Texture, type WebGLRenderer } from "three";
import { kLatticeRow } from "../generated/constants";
import type { Instance } from "../module/instance";
import { FloatTexture } from "./floatTexture";
import { bitsTarget, drawAside, Pass, readBits } from "./pass";
import type { NodeSource, PictureData } from "./records";

/**
 * Writes the nodes of all lattices of a picture into one texture, which ffd.glsl reads. The GPU sums modes up: a basis
 * lies there once for all characters, and a character costs the upload of its coefficients, in its record. Nodes of
 * lattices without modes, and all that the processor sums up, are uploaded. The texture stays from picture to picture,
 * so that hair that sleeps costs nothing.
 */
export class LatticePass {
  /** The nodes of all lattices. */
  readonly #nodes = bitsTarget(kLatticeRow);
  /** The nodes that come from the processor in this picture. */
  readonly #uploaded = new FloatTexture(kLatticeRow);
  /** The modes of each basis, by the number that the picture gives it (`NodeSource.basis`). */
  readonly #bases = new Map<number, DataTexture>();
  #module: Instance | null = null;
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

  /** The GPU memory of all bases. */
  get basisBytes(): number {
    let bytes = 0;
    for (const { image } of this.#bases.values()) bytes += (image.data as Float32Array).byteLength;
    return bytes;
  }

  /**
   * Fills the texture, under the conditions of `drawAside` (pass.ts). The records of the same picture must have been
   * written.
   */
  run(renderer: WebGLRenderer, data: PictureData): void {
    const rows = Math.max(data.nodeRows, 1);
    if (rows !== this.#nodes.height) {
      this.#nodes.setSize(kLatticeRow, rows);
      this.#uniforms.target_rows.value = rows;
    }
    this.#upload(data);
    this.#dropBases(data);
    drawAside(renderer, () => {
      // Shaders need the texture also where it has no nodes: setting the target makes three.js allocate it.
      renderer.setRenderTarget(this.#nodes);
      for (const [number, source] of data.sources.entries()) {
        const { basis, first, end } = source;
        if (end === first) continue;
        this.#uniforms.first_record.value = first;
        this.#uniforms.basis.value = number;
        if (basis > 0) this.#uniforms.modes.value = this.#modesOf(data.module, source);
        (basis > 0 ? this.#summing : this.#copying).draw(renderer, 6, end - first);
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
    this.#drop(() => true);
    this.#summing.dispose();
    this.#copying.dispose();
  }

  #upload({ module, nodes, uploadedRows }: PictureData): void {
    this.#uploaded.reserve(Math.max(uploadedRows, 1));
    if (uploadedRows === 0) return;
    this.#uploaded.values.set(module.floats(nodes, 4 * kLatticeRow * uploadedRows));
    this.#uploaded.write();
  }

  // Frees the bases that no lattice of this picture has. The numbers of bases belong to a module, so a picture of
  // another module keeps none.
  #dropBases({ module, sources }: PictureData): void {
    const isOther = this.#module !== module;
    this.#module = module;
    this.#drop((basis) => isOther || sources.every((source) => source.basis !== basis));
  }

  #drop(isUnused: (basis: number) => boolean): void {
    for (const [basis, texture] of this.#bases) {
      if (!isUnused(basis)) continue;
      texture.dispose();
      this.#bases.delete(basis);
    }
  }

  #modesOf(module: Instance, { basis, scene, index }: NodeSource): DataTexture {
    const known = this.#bases.get(basis);
    if (known) return known;
    const texels = module.allFloats("hairnet_shown_modes", scene, index);
    const modes = new DataTexture(texels, kLatticeRow, texels.length / 4 / kLatticeRow, RGBAFormat, FloatType);
    modes.needsUpdate = true;
    this.#bases.set(basis, modes);
    return modes;
  }
}
