import {
  Color,
  DoubleSide,
  FogExp2,
  GLSL3,
  RawShaderMaterial,
  SRGBColorSpace,
  Vector2,
  Vector3,
  Vector4,
  type Fog,
  type IUniform,
  type Texture,
  type WebGLRenderer,
} from "three";
import { makeLightRig, type LightRig } from "./lightRig";
import { shader } from "./shaders";

/** The kind of part that a material draws. */
export type HairPart = "strand" | "card" | "fabric" | "body";

/** Uniforms that all materials of a scene share, by their names in client/shaders. */
export class SceneUniforms {
  readonly rig: LightRig = makeLightRig();
  readonly all: Record<string, IUniform>;
  readonly #viewport = new Vector4();
  /** Whether the canvas has several samples a pixel; null: not asked yet. */
  #isAntialiased: boolean | null = null;

  constructor(records: Texture, lattices: Texture, placedPoints: Texture) {
    this.all = {
      viewport_px: { value: new Vector2(1, 1) },
      light_direction: { value: this.rig.towards },
      light_colour: { value: this.rig.colours },
      ambient_above: { value: this.rig.ambientAbove },
      ambient_below: { value: this.rig.ambientBelow },
      exposure: { value: 1 },
      fog_colour: { value: new Color(0) },
      fog_range: { value: new Vector3() },
      encode_srgb: { value: 1 },
      samples: { value: 1 },
      dither_seed: { value: 0 },
      records: { value: records },
      lattices: { value: lattices },
      placed_points: { value: placedPoints },
      card_texture: { value: null },
      light_depth_now: { value: null },
      light_depth_rest: { value: null },
    };
  }

  /** Sets the size of the current viewport, and how the bound target takes colours; called for each drawn part. */
  setTarget(renderer: WebGLRenderer): void {
    this.#setViewport(renderer);
    const target = renderer.getRenderTarget();
    // The same decision as in three.js's own materials.
    const isXr = target !== null && (target as { isXRRenderTarget?: boolean }).isXRRenderTarget === true;
    const space = target === null ? renderer.outputColorSpace : isXr ? target.texture.colorSpace : "";
    this.all.encode_srgb.value = space === SRGBColorSpace ? 1 : 0;
    this.#isAntialiased ??= renderer.getContextAttributes()?.antialias === true;
    // An antialiased canvas is taken to have 4 samples a pixel.
    this.all.samples.value = Math.max(target === null ? (this.#isAntialiased ? 4 : 1) : target.samples, 1);
  }

  /** Sets the scene's fog. `fog_range` is near, far and density; 0 where this kind of fog has no such number. */
  setFog(fog: Fog | FogExp2 | null): void {
    const range: Vector3 = this.all.fog_range.value;
    if (fog) this.all.fog_colour.value.copy(fog.color);
    if (fog instanceof FogExp2) range.set(0, 0, fog.density);
    else if (fog) range.set(fog.near, fog.far, 0);
    else range.set(0, 0, 0);
  }

  /** Sets the size of the current viewport of a shadow map, which has one sample a texel. */
  setShadowMap(renderer: WebGLRenderer): void {
    this.#setViewport(renderer);
    this.all.samples.value = 1;
  }

  #setViewport(renderer: WebGLRenderer): void {
    const { z, w } = renderer.getCurrentViewport(this.#viewport);
    this.all.viewport_px.value.set(z, w);
  }
}

/**
 * A material for one part of one groom. `own`: its uniforms beside the shared ones, including first_record and copies.
 */
export function makeMaterial(
  part: HairPart,
  shared: SceneUniforms,
  own: Record<string, IUniform> = {},
): RawShaderMaterial {
  return new RawShaderMaterial({
    name: `hairnet ${part}`,
    side: DoubleSide,
    glslVersion: GLSL3,
    vertexShader: shader(`${part}.vert`),
    fragmentShader: shader(`${part}.frag`),
    alphaToCoverage: part !== "body",
    uniforms: { ...shared.all, first_record: { value: 0 }, copies: { value: 1 }, ...own },
  });
}

/** Draws the depth of one part into shadow maps. `material`: of the same part; it shares its uniforms. */
export function makeShadowMaterial(part: HairPart, material: RawShaderMaterial): RawShaderMaterial {
  return new RawShaderMaterial({
    name: `hairnet ${part} shadow`,
    glslVersion: GLSL3,
    defines: { SHADOW: 1, [part.toUpperCase()]: 1 },
    vertexShader: shader(`${part}.vert`),
    fragmentShader: shader("shadow.frag"),
    uniforms: { ...material.uniforms, copies: { value: 1 } },
  });
}
