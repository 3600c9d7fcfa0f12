import {
  BackSide,
  CircleGeometry,
  DirectionalLight,
  Group,
  HemisphereLight,
  Mesh,
  type PerspectiveCamera,
  type RawShaderMaterial,
  ShaderMaterial,
  SphereGeometry,
  Vector2,
  Vector3,
  Vector4,
} from "three";
import type { HairPart } from "../src/scene/index";
import type { LightRig } from "../src/scene/lightRig";

/** A bust's height below its head joint, m: it ends above the ground. */
export const kBustHeightM = 0.375;
/** The ground ends at this distance from the middle of the people. */
const kGroundRadiusM = 9;
/** The ground has the shadows of at most this many people, the nearest to the camera. */
const kShadowsMax = 16;
/** A bust darkens below the first of these heights in head space, and ends at the second, m. */
const kFadeFromM = -0.13;
const kFadeToM = -0.345;

// Colours are linear RGB. Noise of half a step hides the steps of a dark gradient on 8-bit screens.
const kCommon = /* glsl */ `
  float noise(vec2 p) { return fract(sin(dot(p, vec2(12.9898, 78.233))) * 43758.5453) - 0.5; }
  vec4 toTarget(vec3 colour, float alpha) {
    vec4 linear = linearToOutputTexel(vec4(colour, alpha));
    return vec4(linear.rgb + noise(gl_FragCoord.xy) / 255.0, alpha);
  }
`;

/** The light from all around: a horizon behind the heads, brighter behind the middle of the free part of the view. */
const kBackdropVertex = /* glsl */ `
  varying vec3 towards;
  void main() {
    towards = position;
    gl_Position = (projectionMatrix * vec4(mat3(viewMatrix) * position, 1.0)).xyww;
  }
`;
const kBackdropFragment = /* glsl */ `
  varying vec3 towards;
  uniform vec2 middlePx;
  uniform float viewPx;
  ${kCommon}
  void main() {
    float up = normalize(towards).y;
    vec3 colour = mix(vec3(0.040, 0.046, 0.060), vec3(0.007, 0.008, 0.012), smoothstep(-0.05, 0.75, up));
    colour = mix(colour, vec3(0.012, 0.0125, 0.015), smoothstep(-0.04, -0.42, up));
    vec2 away = (gl_FragCoord.xy - middlePx) / viewPx;
    colour += vec3(0.096, 0.084, 0.076) * exp(-5.5 * dot(away, away) - 6.0 * max(-up, 0.0));
    colour *= 1.0 - 0.42 * smoothstep(0.3, 1.05, length(away));
    gl_FragColor = toTarget(colour, 1.0);
  }
`;

/**
 * The ground: a pool of light about `middle` (x, z) that fades into the backdrop towards `radius`, m. Each person has a
 * soft shadow below: a Gaussian of that radius, which takes `strength` of the light in its middle.
 */
const kGroundVertex = /* glsl */ `
  varying vec2 place;
  void main() {
    vec4 world = modelMatrix * vec4(position, 1.0);
    place = world.xz;
    gl_Position = projectionMatrix * viewMatrix * world;
  }
`;
const kGroundFragment = /* glsl */ `
  varying vec2 place;
  uniform vec2 middle;
  uniform float radius;
  uniform vec4 shadows[${kShadowsMax}];  // x, z, radius, strength
  ${kCommon}
  void main() {
    float away = length(place - middle);
    vec3 colour = mix(vec3(0.074, 0.069, 0.065), vec3(0.017, 0.018, 0.022), smoothstep(0.0, radius, away));
    float light = 1.0;
    for (int n = 0; n < ${kShadowsMax}; ++n) {
      vec2 from = (place - shadows[n].xy) / max(shadows[n].z, 1e-3);
      light *= 1.0 - shadows[n].w * exp(-dot(from, from));
    }
    gl_FragColor = toTarget(colour * light, 0.9 * (1.0 - smoothstep(0.35 * radius, radius, away)));
  }
`;

/** Where a person stands, for the shadow and the height of the ground. */
export interface Standing {
  /** The place of the head joint, world, m. */
  readonly head: Vector3;
  /** The height of the head joint above the ground on which the person stands, m. */
  readonly height: number;
}

/** What is around the people of a room: a backdrop, ground with soft shadows, and lights for ordinary materials. */
export class Surroundings extends Group {
  readonly #backdrop = new ShaderMaterial({
    name: "backdrop",
    side: BackSide,
    depthTest: false,
    depthWrite: false,
    uniforms: { middlePx: { value: new Vector2() }, viewPx: { value: 1 } },
    vertexShader: kBackdropVertex,
    fragmentShader: kBackdropFragment,
  });
  readonly #ground = new ShaderMaterial({
    name: "ground",
    transparent: true,
    uniforms: {
      middle: { value: new Vector2() },
      radius: { value: 4 },
      shadows: { value: Array.from({ length: kShadowsMax }, () => new Vector4()) },
    },
    vertexShader: kGroundVertex,
    fragmentShader: kGroundFragment,
  });
  readonly #floor = new Mesh(new CircleGeometry(kGroundRadiusM, 48).rotateX(-Math.PI / 2), this.#ground);
  readonly #lights = [new DirectionalLight(), new DirectionalLight(), new DirectionalLight()];
  readonly #ambient = new HemisphereLight();

  constructor() {
    super();
    this.name = "surroundings";
    const backdrop = new Mesh(new SphereGeometry(1, 32, 16), this.#backdrop);
    // The backdrop is drawn first, behind everything.
    backdrop.renderOrder = -10;
    backdrop.frustumCulled = false;
    // The ground is transparent at its edge, and other transparent things stand on it.
    this.#floor.renderOrder = -9;
    this.#floor.visible = false;
    this.add(backdrop, this.#floor, ...this.#lights, this.#ambient);
  }

  /**
   * Call it before each picture. `rig`: the lights of the hair; null: not known yet. `people`: all who are visible;
   * without people there is no ground. `middlePx`: the middle of the free part of the view, device pixels;
   * `viewPx`: the smaller side of that part.
   */
  update(
    camera: PerspectiveCamera,
    rig: LightRig | null,
    people: readonly Standing[],
    middlePx: Vector2,
    viewPx: number,
  ): void {
    this.#backdrop.uniforms.middlePx.value.copy(middlePx);
    this.#backdrop.uniforms.viewPx.value = viewPx;
    if (rig) this.#light(rig);
    this.#floor.visible = people.length > 0;
    if (people.length === 0) return;
    const heads = people.map(({ head }) => head);
    const { middle, radius, shadows } = this.#ground.uniforms;
    const sum = heads.reduce((total, head) => total.add(head), new Vector3()).divideScalar(heads.length);
    middle.value.set(sum.x, sum.z);
    const spread = heads.reduce((most, head) => Math.max(most, Math.hypot(head.x - sum.x, head.z - sum.z)), 0);
    // The light reaches 3.2 m beyond the outermost person. The ground is as low as the lowest person needs it.
    radius.value = Math.min(3.2 + spread, kGroundRadiusM);
    const ground = Math.min(...people.map(({ head, height }) => head.y - height));
    this.#floor.position.set(sum.x, ground, sum.z);
    const near = [...heads].sort((a, b) => a.distanceTo(camera.position) - b.distanceTo(camera.position));
    for (const [n, shadow] of (shadows.value as Vector4[]).entries()) {
      const head = near[n];
      // A higher head has a wider, softer shadow, of 0.8 strength. A place without a person has the strength 0.
      const height = head ? head.y - ground : 0;
      if (head) shadow.set(head.x, head.z, 0.14 + 0.35 * height, 0.8);
      else shadow.set(0, 0, 1, 0);
    }
  }

  // Ordinary materials, such as an avatar's, get the light that hair gets. The colours of a rig are those after the
  // division by pi (src/scene/lightRig.ts) that three.js makes where light meets a surface: so the intensity is pi.
  #light(rig: LightRig): void {
    for (const [n, light] of this.#lights.entries()) {
      light.position.copy(rig.towards[n]).multiplyScalar(10);
      light.color.copy(rig.colours[n]);
      light.intensity = Math.PI;
    }
    this.#ambient.color.copy(rig.ambientAbove);
    this.#ambient.groundColor.copy(rig.ambientBelow);
    this.#ambient.intensity = Math.PI;
  }
}

/**
 * Changes the shader of busts, which end below the shoulders. Each falls into shadow there, and its last centimetres
 * are transparent, so that its cut does not show. For `onMaterial` of `HairSceneOptions`.
 */
export function fadeBust(material: RawShaderMaterial, part: HairPart): void {
  if (part !== "body") return;
  material.transparent = true;
  material.vertexShader = material.vertexShader.replace(
    "void main() {",
    "out float height_head;\nvoid main() {\n  height_head = rest.y;",
  );
  const end = material.fragmentShader.lastIndexOf("}");
  material.fragmentShader = `${material.fragmentShader
    .slice(0, end)
    .replace("void main() {", "in float height_head;\nvoid main() {")}
  float lit = smoothstep(${kFadeToM}, ${kFadeFromM}, height_head);
  colour.rgb *= mix(vec3(0.1, 0.1, 0.11), vec3(1.0), lit);
  colour.a *= smoothstep(0.0, 0.06, lit);
}`;
}
