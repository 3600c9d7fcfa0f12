import {
  AddEquation,
  Camera,
  ClampToEdgeWrapping,
  Color,
  CustomBlending,
  DoubleSide,
  GLSL3,
  HalfFloatType,
  InstancedBufferGeometry,
  LinearFilter,
  Mesh,
  NoBlending,
  OneFactor,
  Points,
  RawShaderMaterial,
  RGBAFormat,
  RGFormat,
  WebGLRenderTarget,
  type IUniform,
  type Object3D,
  type PixelFormat,
  type Texture,
  type WebGLRenderer,
} from "three";
import { kDensitySide } from "../generated/constants";
import type { LightRig } from "./lightRig";
import type { GroomDrawing } from "./groomDrawing";
import { shader } from "./shaders";

/** Characters with one groom, the records of which begin at `first`; the largest count of points that one adds. */
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
  readonly #density = makeTarget(RGFormat, 1);
  readonly #light = makeTarget(RGBAFormat, 2);
  readonly #uniforms: Record<string, IUniform>;
  readonly #pointGeometry = new InstancedBufferGeometry();
  readonly #lightGeometry = new InstancedBufferGeometry();
  readonly #points: Points<InstancedBufferGeometry, RawShaderMaterial>;
  readonly #march: Mesh<InstancedBufferGeometry, RawShaderMaterial>;
  readonly #camera = new Camera();
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
    this.#lightGeometry.setDrawRange(0, 6);
    const adding = { blending: CustomBlending, blendEquation: AddEquation, blendSrc: OneFactor, blendDst: OneFactor };
    this.#points = new Points(this.#pointGeometry, this.#makeMaterial("density_points", adding));
    this.#march = new Mesh(this.#lightGeometry, this.#makeMaterial("density_light", { blending: NoBlending }));
    this.#points.frustumCulled = this.#march.frustumCulled = false;
  }

  /** The optical depths now and at rest. */
  get textures(): { now: Texture; rest: Texture } {
    const [now, rest] = this.#light.textures;
    return { now, rest };
  }

  isSupported(renderer: WebGLRenderer): boolean {
    return renderer.extensions.has("EXT_color_buffer_float");
  }

  /** `grids`: of all characters. Do not call it while the renderer draws something else. */
  run(renderer: WebGLRenderer, grooms: readonly DenseGroom[], grids: number): void {
    if (grids === 0) return;
    this.#reserve(grids);
    const before = renderer.getRenderTarget();
    const { autoClear } = renderer;
    const xr = renderer.xr.enabled;
    const alpha = renderer.getClearAlpha();
    renderer.getClearColor(this.#clearColour);
    renderer.autoClear = renderer.xr.enabled = false;
    renderer.setRenderTarget(this.#density);
    renderer.setClearColor(0, 0);
    renderer.clear(true, false, false);
    renderer.setClearColor(this.#clearColour, alpha);
    let characters = 0;
    for (const groom of grooms) {
      characters += groom.characters;
      if (groom.points === 0) continue;
      this.#pointGeometry.setDrawRange(0, groom.points);
      this.#uniforms.rest_points.value = groom.drawing.restPoints;
      this.#uniforms.rest_arcs.value = groom.drawing.restArcs;
      this.#draw(renderer, this.#points, groom.first, 4 * groom.characters);
    }
    renderer.setRenderTarget(this.#light);
    this.#draw(renderer, this.#march, 0, characters);
    renderer.setRenderTarget(before);
    renderer.autoClear = autoClear;
    renderer.xr.enabled = xr;
  }

  dispose(): void {
    this.#density.dispose();
    this.#light.dispose();
    this.#pointGeometry.dispose();
    this.#lightGeometry.dispose();
    this.#points.material.dispose();
    this.#march.material.dispose();
  }

  #draw(
    renderer: WebGLRenderer,
    object: Object3D & { geometry: InstancedBufferGeometry },
    first: number,
    instances: number,
  ) {
    object.geometry.instanceCount = instances;
    this.#uniforms.first_record.value = first;
    renderer.render(object, this.#camera);
  }

  #reserve(grids: number): void {
    const rows = grids * kDensitySide;
    const { width, height } = this.#density;
    if (rows <= height && height <= 4 * rows) return;
    this.#density.setSize(width, rows);
    this.#light.setSize(width, rows);
    this.#uniforms.target_rows.value = rows;
  }

  #makeMaterial(name: string, blending: object): RawShaderMaterial {
    return new RawShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: shader(`${name}.vert`),
      fragmentShader: shader(`${name}.frag`),
      uniforms: this.#uniforms,
      side: DoubleSide,
      depthTest: false,
      depthWrite: false,
      ...blending,
    });
  }
}

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
