import {
  Camera,
  DoubleSide,
  GLSL3,
  InstancedBufferGeometry,
  Mesh,
  NearestFilter,
  NoBlending,
  RawShaderMaterial,
  RGBAIntegerFormat,
  UnsignedIntType,
  WebGLRenderTarget,
  type IUniform,
  type Texture,
  type WebGLRenderer,
} from "three";
import { kPointRow, kRowsMax } from "../generated/constants";
import type { Drawn, GroomDrawing } from "./groomDrawing";
import { shader } from "./shaders";
import { SkinTexture } from "./skinTexture";

/** Characters with one groom: their records from `first` on. */
export interface PlacedGroom {
  readonly drawing: GroomDrawing;
  readonly first: number;
  readonly characters: number;
}

/**
 * Places the points of strands before the strands are drawn: deforms them, pushes them out of the skin, and limits
 * every strand to its length at rest (`SkinPush` and `StrandLengths` in shaders). Two passes write textures of points; client/shaders/strand_points.glsl has their
 * layout.
 */
export class StrandDeformPass {
  readonly #deformed = makeTarget();
  readonly #placed = makeTarget();
  readonly #uniforms: Record<string, IUniform>;
  readonly #geometry = new InstancedBufferGeometry();
  readonly #deform: Mesh<InstancedBufferGeometry, RawShaderMaterial>;
  readonly #place: Mesh<InstancedBufferGeometry, RawShaderMaterial>;
  readonly #camera = new Camera();

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
    this.#geometry.setDrawRange(0, 6);
    this.#deform = this.#makePass("deform_points.frag");
    this.#place = this.#makePass("limit_lengths.frag");
  }

  /** The placed points. */
  get texture(): Texture {
    return this.#placed.texture;
  }

  /** Its GPU memory. */
  get bytes(): number {
    return 2 * 16 * kPointRow * this.#placed.height;
  }

  rowsMax(renderer: WebGLRenderer): number {
    return Math.min(renderer.capabilities.maxTextureSize, kRowsMax);
  }

  /**
   * `rows`: of all characters; their records say which rows each has. Do not call it while the renderer draws something
   * else.
   */
  place(renderer: WebGLRenderer, grooms: readonly PlacedGroom[], rows: number): void {
    if (rows === 0) return;
    this.#reserve(rows);
    const before = renderer.getRenderTarget();
    const { autoClear } = renderer;
    const xr = renderer.xr.enabled;
    renderer.autoClear = renderer.xr.enabled = false;
    for (const { drawing, first, characters } of grooms) {
      this.#geometry.instanceCount = characters;
      this.#uniforms.first_record.value = first;
      this.#uniforms.rest_points.value = drawing.restPoints;
      this.#uniforms.rest_arcs.value = drawing.restArcs;
      for (const [name, { value }] of Object.entries(drawing.skin.uniforms)) this.#uniforms[name].value = value;
      renderer.setRenderTarget(this.#deformed);
      renderer.render(this.#deform, this.#camera);
      renderer.setRenderTarget(this.#placed);
      renderer.render(this.#place, this.#camera);
    }
    renderer.setRenderTarget(before);
    renderer.autoClear = autoClear;
    renderer.xr.enabled = xr;
  }

  dispose(): void {
    this.#deformed.dispose();
    this.#placed.dispose();
    this.#geometry.dispose();
    this.#deform.material.dispose();
    this.#place.material.dispose();
  }

  // The textures' contents are lost when their size changes.
  #reserve(rows: number): void {
    const { height } = this.#placed;
    if (rows <= height && height <= 4 * rows) return;
    const wanted = Math.max(rows, Math.min(Math.ceil(1.25 * rows), kRowsMax));
    this.#deformed.setSize(kPointRow, wanted);
    this.#placed.setSize(kPointRow, wanted);
    this.#uniforms.target_rows.value = wanted;
  }

  #makePass(fragment: string): Mesh<InstancedBufferGeometry, RawShaderMaterial> {
    const material = new RawShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: shader("points.vert"),
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
  // Each character may waste one row.
  const scale = Math.max(rowsMax - characters, 0) / rows;
  for (const { shown } of grooms)
    for (const one of shown) one.detail = { ...one.detail, strandShare: scale * Math.min(one.detail.strandShare, 1) };
}

function makeTarget(): WebGLRenderTarget {
  return new WebGLRenderTarget(kPointRow, 1, {
    format: RGBAIntegerFormat,
    type: UnsignedIntType,
    internalFormat: "RGBA32UI",
    minFilter: NearestFilter,
    magFilter: NearestFilter,
    generateMipmaps: false,
    depthBuffer: false,
  });
}
