import {
  AddEquation,
  ClampToEdgeWrapping,
  Color,
  CustomBlending,
  HalfFloatType,
  LinearFilter,
  OneFactor,
  RGBAFormat,
  RGFormat,
  WebGLRenderTarget,
  type IUniform,
  type PixelFormat,
  type Texture,
  type WebGLRenderer,
} from "three";
import { kDensitySide } from "../generated/constants";
import type { LightRig } from "./lightRig";
import type { GroomDrawing } from "./groomDrawing";
import { drawAside, Pass } from "./pass";

/** Characters with one groom, whose records begin at `first`. `points`: the most points that one character adds. */
export interface DenseGroom {
  readonly drawing: GroomDrawing;
  readonly first: number;
  readonly characters: number;
  readonly points: number;
}

/**
 * Follows the light through hair that moves: adds the placed points of strands to grids of density, and marches from
 * each cell towards the lights (client/shaders/density.glsl). Needs a device that draws half floats.
 */
export class HairDensityPass {
  /** The grids of density, one below the other: red is the hair now, and green is the hair at rest. */
  readonly #density = makeTarget(RGFormat, 1);
  /** The optical depths towards key, fill and rim light and upwards, in one texture for now and one for rest. */
  readonly #light = makeTarget(RGBAFormat, 2);
  readonly #uniforms: Record<string, IUniform>;
  readonly #points: Pass;
  readonly #march: Pass;
  readonly #clearColour = new Color();

  constructor(records: Texture, placedPoints: Texture, rig: LightRig) {
    this.#uniforms = {
      records: { value: records },
      placed_points: { value: placedPoints },
      rest_points: { value: null },
      rest_arcs: { value: null },
      first_record: { value: 0 },
      target_rows: { value: kDensitySide },
      density: { value: this.#density.texture },
      light_direction: { value: rig.towards },
    };
    const adding = {
      blending: CustomBlending,
      blendEquation: AddEquation,
      blendSrc: OneFactor,
      blendDst: OneFactor,
    } as const;
    this.#points = new Pass("density_points.vert", "density_points.frag", this.#uniforms, adding);
    this.#march = new Pass("density_light.vert", "density_light.frag", this.#uniforms);
  }

  /** The optical depths now and at rest. */
  get textures(): { now: Texture; rest: Texture } {
    const [now, rest] = this.#light.textures;
    return { now, rest };
  }

  isSupported(renderer: WebGLRenderer): boolean {
    return renderer.extensions.has("EXT_color_buffer_float");
  }

  /** Fills `textures`, under the conditions of `drawAside` (pass.ts). `grids`: the count of all characters' grids. */
  run(renderer: WebGLRenderer, grooms: readonly DenseGroom[], grids: number): void {
    if (grids === 0) return;
    this.#reserve(grids);
    const alpha = renderer.getClearAlpha();
    renderer.getClearColor(this.#clearColour);
    drawAside(renderer, () => {
      renderer.setRenderTarget(this.#density);
      renderer.setClearColor(0, 0);
      renderer.clear(true, false, false);
      renderer.setClearColor(this.#clearColour, alpha);
      let count = 0;
      for (const { drawing, first, characters, points } of grooms) {
        count += characters;
        if (points === 0) continue;
        this.#uniforms.rest_points.value = drawing.restPoints;
        this.#uniforms.rest_arcs.value = drawing.restArcs;
        this.#uniforms.first_record.value = first;
        // Each point is drawn four times: for now and for rest, each in two slices (density_points.vert).
        this.#points.draw(renderer, points, 4 * characters);
      }
      renderer.setRenderTarget(this.#light);
      this.#uniforms.first_record.value = 0;
      // An instance is a rectangle of two triangles for each character.
      this.#march.draw(renderer, 6, count);
    });
  }

  dispose(): void {
    this.#density.dispose();
    this.#light.dispose();
    this.#points.dispose();
    this.#march.dispose();
  }

  #reserve(grids: number): void {
    const rows = grids * kDensitySide;
    const { width, height } = this.#density;
    // The textures keep their size until they are too small, or more than four times too large.
    if (rows <= height && height <= 4 * rows) return;
    this.#density.setSize(width, rows);
    this.#light.setSize(width, rows);
    this.#uniforms.target_rows.value = rows;
  }
}

/** A target for grids, whose slices lie side by side: a row of kDensitySide squares of that side. */
function makeTarget(format: PixelFormat, count: number): WebGLRenderTarget {
  return new WebGLRenderTarget(kDensitySide * kDensitySide, kDensitySide, {
    format,
    count,
    type: HalfFloatType,
    minFilter: LinearFilter,
    magFilter: LinearFilter,
    wrapS: ClampToEdgeWrapping,
    wrapT: ClampToEdgeWrapping,
    generateMipmaps: false,
    depthBuffer: false,
  });
}
