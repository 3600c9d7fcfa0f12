import { DataTexture, FloatType, NearestFilter, RGBAFormat } from "three";

/** Once the texture has grown, it has at least this many rows. */
const kRowsMin = 8;

/** A texture of RGBA floats that grows and shrinks by rows and is rewritten every frame. */
export class FloatTexture {
  readonly texture: DataTexture;
  /** The contents, 4 numbers a texel, row by row. Write to it, then call `write`. */
  values: Float32Array<ArrayBuffer>;
  #rows = 1;

  /** `width` in texels */
  constructor(readonly width: number) {
    this.values = new Float32Array(4 * width);
    this.texture = new DataTexture(this.values, width, 1, RGBAFormat, FloatType);
    this.texture.minFilter = this.texture.magFilter = NearestFilter;
    this.texture.generateMipmaps = false;
    this.texture.needsUpdate = true;
  }

  /** Makes room for that many rows; old contents may be lost. `values` may be another array afterwards. */
  reserve(rows: number): void {
    // Each write sends all of it to the GPU, so it does not stay much larger than needed.
    if (rows <= this.#rows && this.#rows <= Math.max(4 * rows, kRowsMin)) return;
    this.#rows = Math.max(Math.ceil(1.5 * rows), kRowsMin);
    this.values = new Float32Array(4 * this.width * this.#rows);
    // The size of a texture is fixed once it is on the GPU, so the GPU texture is created again.
    this.texture.dispose();
    this.texture.image = { data: this.values, width: this.width, height: this.#rows };
  }

  /** Sends `values` to the GPU for the next drawing. */
  write(): void {
    this.texture.needsUpdate = true;
  }

  dispose(): void {
    this.texture.dispose();
  }
}
