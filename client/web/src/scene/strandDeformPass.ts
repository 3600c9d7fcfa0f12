import type { IUniform, Texture, WebGLRenderer } from "three";
import { kPointRow, kRowsMax } from "../generated/constants";
import type { Drawn, GroomDrawing } from "./groomDrawing";
import { bitsTarget, drawAside, Pass, readBits } from "./pass";
import { SkinTexture } from "./skinTexture";

/** Characters with one groom, whose records begin at `first`. */
export interface PlacedGroom {
  readonly drawing: GroomDrawing;
  readonly first: number;
  readonly characters: number;
}

/**
 * Places the points of strands before the strands are drawn: deforms them, pushes them out of the skin, and limits
 * every strand to its length at rest. Two passes write textures of points; client/shaders/strand_points.glsl has their
 * layout.
 */
export class StrandDeformPass {
  readonly #deformed = bitsTarget(kPointRow);
  readonly #placed = bitsTarget(kPointRow);
  readonly #uniforms: Record<string, IUniform>;
  readonly #deform: Pass;
  readonly #place: Pass;

  constructor(records: Texture, lattices: Texture) {
    this.#uniforms = {
      records: { value: records },
      lattices: { value: lattices },
      deformed_points: { value: this.#deformed.texture },
      rest_points: { value: null },
      rest_arcs: { value: null },
      first_record: { value: 0 },
      target_rows: { value: 1 },
      ...new SkinTexture().uniforms,
    };
    this.#deform = new Pass("points.vert", "deform_points.frag", this.#uniforms);
    this.#place = new Pass("points.vert", "limit_lengths.frag", this.#uniforms);
  }

  /** The placed points. */
  get texture(): Texture {
    return this.#placed.texture;
  }

  /** The GPU memory of the two textures, of 16 bytes a texel. */
  get bytes(): number {
    return 2 * 16 * kPointRow * this.#placed.height;
  }

  /** The most rows that the textures can have on this device. */
  rowsMax(renderer: WebGLRenderer): number {
    return Math.min(renderer.capabilities.maxTextureSize, kRowsMax);
  }

  /**
   * Places the points of these characters, under the conditions of `drawAside` (pass.ts). `rows`: the rows of all
   * characters together; each record says which rows the character has.
   */
  place(renderer: WebGLRenderer, grooms: readonly PlacedGroom[], rows: number): void {
    if (rows === 0) return;
    this.#reserve(rows);
    drawAside(renderer, () => {
      for (const { drawing, first, characters } of grooms) {
        this.#uniforms.first_record.value = first;
        this.#uniforms.rest_points.value = drawing.restPoints;
        this.#uniforms.rest_arcs.value = drawing.restArcs;
        for (const [name, { value }] of Object.entries(drawing.skin.uniforms)) this.#uniforms[name].value = value;
        renderer.setRenderTarget(this.#deformed);
        this.#deform.draw(renderer, 6, characters);
        renderer.setRenderTarget(this.#placed);
        this.#place.draw(renderer, 6, characters);
      }
    });
  }

  /** The points from row 0 on, 4 numbers each, as the GPU has them. For tests. */
  read(renderer: WebGLRenderer, points: number): Float32Array {
    return readBits(renderer, this.#placed, 0, points);
  }

  dispose(): void {
    this.#deformed.dispose();
    this.#placed.dispose();
    this.#deform.dispose();
    this.#place.dispose();
  }

  // Makes room for that many rows. Contents are lost when the size changes, so the textures change only when they are
  // too small, or more than four times too large.
  #reserve(rows: number): void {
    const { height } = this.#placed;
    if (rows <= height && height <= 4 * rows) return;
    const wanted = Math.max(rows, Math.min(Math.ceil(1.25 * rows), kRowsMax));
    this.#deformed.setSize(kPointRow, wanted);
    this.#placed.setSize(kPointRow, wanted);
    this.#uniforms.target_rows.value = wanted;
  }
}

/** Lowers the strand shares of all characters alike until their points fit in that many rows. */
export function fitShares(
  grooms: readonly { readonly drawing: GroomDrawing | null; readonly shown: readonly Drawn[] }[],
  rowsMax: number,
): void {
  let rows = 0;
  let characters = 0;
  for (const { drawing, shown } of grooms)
    for (const one of shown) {
      rows += drawing?.pointRowsOf(one) ?? 0;
      characters += 1;
    }
  if (rows <= rowsMax) return;
  // Each character begins in a row of its own, so it may waste up to one row.
  const scale = Math.max(rowsMax - characters, 0) / rows;
  for (const { shown } of grooms)
    for (const one of shown) one.detail.strandShare = scale * Math.min(one.detail.strandShare, 1);
}
