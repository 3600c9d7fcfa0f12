import { AmbientLight, Color, DirectionalLight, HemisphereLight, Vector3, type Camera, type Object3D } from "three";
import type { Instance } from "../module/instance";

/** The size of a `hairnet_lights` of client/hairnet.h: 24 floats. */
const kLightsBytes = 96;

/** Distant key, fill and rim lights, and ambient light. Linear RGB. */
export interface LightRig {
  /** The directions towards the three lights: unit vectors, scene. */
  readonly towards: readonly Vector3[];
  readonly colours: readonly Color[];
  readonly ambientAbove: Color;
  readonly ambientBelow: Color;
}

export function makeLightRig(): LightRig {
  return {
    towards: [new Vector3(0, 1, 0), new Vector3(0, 1, 0), new Vector3(0, 1, 0)],
    colours: [new Color(0), new Color(0), new Color(0)],
    ambientAbove: new Color(0),
    ambientBelow: new Color(0),
  };
}

/** The studio turns with the camera's bearing, so that front, side and back have the same light. */
export function studioLights(module: Instance, camera: Camera, rig: LightRig): void {
  const towards = camera.getWorldDirection(new Vector3()).negate();
  const lights = module.struct(kLightsBytes, (at) => {
    const [x, y, z] = towards.toArray();
    // The module's argument, three doubles, lies behind its result.
    module.doubleMemory().set([x, y, z], (at + kLightsBytes) / 8);
    module.call("hairnet_studio_lights", at + kLightsBytes, at);
  });
  const memory = module.floats(lights.byteOffset, kLightsBytes / 4);
  for (let n = 0; n < 3; ++n) {
    rig.towards[n].fromArray(memory, 3 * n);
    rig.colours[n].fromArray(memory, 9 + 3 * n);
  }
  rig.ambientAbove.fromArray(memory, 18);
  rig.ambientBelow.fromArray(memory, 21);
}

/**
 * The visible lights of a three.js scene: its three brightest directional ones, ambient and hemisphere lights. Ignores
 * point, spot and area lights. three.js divides light by pi where it meets a surface, and so does this.
 */
export function sceneLights(root: Object3D, rig: LightRig): void {
  const directional: DirectionalLight[] = [];
  rig.ambientAbove.setRGB(0, 0, 0);
  rig.ambientBelow.setRGB(0, 0, 0);
  root.traverseVisible((object) => {
    if (object instanceof DirectionalLight) directional.push(object);
    if (object instanceof AmbientLight) {
      addLight(rig.ambientAbove, object.color, object.intensity);
      addLight(rig.ambientBelow, object.color, object.intensity);
    }
    if (object instanceof HemisphereLight) {
      addLight(rig.ambientAbove, object.color, object.intensity);
      addLight(rig.ambientBelow, object.groundColor, object.intensity);
    }
  });
  directional.sort((a, b) => brightness(b) - brightness(a));
  const target = new Vector3();
  for (let n = 0; n < 3; ++n) {
    const light = directional[n];
    rig.colours[n].setRGB(0, 0, 0);
    if (!light) continue;
    addLight(rig.colours[n], light.color, light.intensity);
    rig.towards[n].setFromMatrixPosition(light.matrixWorld).sub(target.setFromMatrixPosition(light.target.matrixWorld));
    if (rig.towards[n].lengthSq() > 0) rig.towards[n].normalize();
    else rig.towards[n].set(0, 1, 0);
  }
}

function addLight(sum: Color, colour: Color, intensity: number): void {
  const share = intensity / Math.PI;
  sum.setRGB(sum.r + colour.r * share, sum.g + colour.g * share, sum.b + colour.b * share);
}

/** The luminance of a light; the factors are those of linear RGB (Rec. 709). */
function brightness(light: DirectionalLight): number {
  return light.intensity * (0.2126 * light.color.r + 0.7152 * light.color.g + 0.0722 * light.color.b);
}
