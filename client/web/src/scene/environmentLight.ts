import {
  CubeCamera,
  HalfFloatType,
  Scene,
  Vector3,
  WebGLCubeRenderTarget,
  type Color,
  type SphericalHarmonics3,
  type Texture,
  type WebGLRenderer,
} from "three";
import { LightProbeGenerator } from "three/addons/lights/LightProbeGenerator.js";
import type { LightRig } from "./lightRig";

/** The side of each face of the cube into which the environment is drawn. The few harmonics need no finer picture. */
const kSidePx = 16;

/** The light of a scene's `environment`, found once for each texture and rotation. */
export class EnvironmentLight {
  // The environment that `#harmonics` belongs to, or will belong to: its texture, version and rotation.
  #texture: Texture | null = null;
  #version = -1;
  #rotation = "";
  #harmonics: SphericalHarmonics3 | null = null;
  // Counts the searches: only the last one's result counts, since an earlier one may end after it.
  #searches = 0;

  /**
   * The radiance of the scene's environment. Null: the scene has no environment, or the radiance is not found yet. Do
   * not call it while the renderer draws something else.
   */
  of(renderer: WebGLRenderer, scene: Scene): SphericalHarmonics3 | null {
    const { environment, environmentRotation } = scene;
    if (!environment) return null;
    const rotation = environmentRotation.toArray().join();
    if (environment === this.#texture && environment.version === this.#version && rotation === this.#rotation)
      return this.#harmonics;
    this.#texture = environment;
    this.#version = environment.version;
    this.#rotation = rotation;
    void this.#find(renderer, scene);
    return this.#harmonics;
  }

  async #find(renderer: WebGLRenderer, { environment, environmentRotation }: Scene): Promise<void> {
    const search = ++this.#searches;
    const target = new WebGLCubeRenderTarget(kSidePx, { type: HalfFloatType });
    const around = new Scene();
    around.background = environment;
    around.backgroundRotation.copy(environmentRotation);
    new CubeCamera(0.1, 10, target).update(renderer, around);
    try {
      const { sh } = await LightProbeGenerator.fromCubeRenderTarget(renderer, target);
      if (search === this.#searches) this.#harmonics = sh;
    } catch {
      if (search === this.#searches) this.#texture = null; // the context is lost: the next picture tries again
    } finally {
      target.dispose();
    }
  }
}

/**
 * Adds an environment's light: what its brightest side has more than the opposite side is a directional light, if the
 * rig has a free one; the remainder is ambient light. three.js divides light by pi where it meets a surface, and so
 * does this.
 */
export function addEnvironment(rig: LightRig, harmonics: SphericalHarmonics3, intensity: number): void {
  const share = intensity / Math.PI;
  const irradiance = (normal: Vector3) => harmonics.getIrradianceAt(normal, new Vector3()).multiplyScalar(share);
  const up = new Vector3(0, 1, 0);
  const above = irradiance(up);
  const below = irradiance(up.clone().negate());
  // The coefficients 1 to 3 are those of y, z and x: together they are the direction of the brightest side. The factors
  // make luminance of linear RGB (Rec. 709).
  const [, y, z, x] = harmonics.coefficients.map((c) => 0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z);
  const towards = new Vector3(x, y, z);
  const free = rig.colours.findIndex((colour) => colour.r + colour.g + colour.b === 0);
  if (free >= 0 && towards.length() > 1e-6) {
    towards.normalize();
    const more = irradiance(towards).sub(irradiance(towards.clone().negate()));
    more.max(new Vector3());
    rig.towards[free].copy(towards);
    rig.colours[free].setRGB(more.x, more.y, more.z);
    // What the directional light gives to surfaces that face up or down is taken from the ambient light: the sum stays.
    above.addScaledVector(more, -Math.max(towards.y, 0));
    below.addScaledVector(more, -Math.max(-towards.y, 0));
  }
  addTo(rig.ambientAbove, above);
  addTo(rig.ambientBelow, below);
}

function addTo(sum: Color, light: Vector3): void {
  sum.setRGB(sum.r + Math.max(light.x, 0), sum.g + Math.max(light.y, 0), sum.b + Math.max(light.z, 0));
}
