import { type PerspectiveCamera, type Scene, Vector3, type WebGLRenderer } from "three";
import { rigidPose } from "../src/index";
import type { Groom } from "../src/hair/groom";
import { HairScene, type HairSceneOptions } from "../src/scene/index";

/** Too small for a pixel, m. */
const kTinyM = 1e-6;
const kAheadM = 2;

/**
 * Draws a hair and a body that are too small to be seen, while the first hairstyle is on its way: the machine then makes
 * the shaders, which takes seconds where software plays the GPU. Keep it until there is other hair, which uses the same
 * shaders.
 */
export class Rehearsal {
  readonly #hair: HairScene;
  #isOver = false;

  constructor(
    private readonly renderer: WebGLRenderer,
    private readonly scene: Scene,
    private readonly camera: PerspectiveCamera,
    options: HairSceneOptions,
  ) {
    this.#hair = new HairScene({ sample: () => [this.#member()] }, renderer, options);
    this.#hair.lightFollowsHair = false;
  }

  /** Call it before pictures. Draws the whole scene to the canvas, once. */
  draw(): void {
    if (this.#isOver) return;
    this.#hair.update(this.camera);
    // The worker makes the geometry meanwhile.
    this.#isOver = [...this.#hair.characters.values()].every((one) => one.isReady);
    if (!this.#isOver) return;
    this.scene.add(this.#hair);
    this.renderer.render(this.scene, this.camera);
    this.#hair.removeFromParent();
  }

  dispose(): void {
    this.#isOver = true;
    this.#hair.dispose();
  }

  #member() {
    const ahead = this.camera.getWorldDirection(new Vector3()).multiplyScalar(kAheadM);
    const { x, y, z } = ahead.add(this.camera.position);
    const pose = rigidPose([0, 0, 0, 1], [x, y, z]);
    return { member: 1, own: false, groomKey: "tiny", groom: kTinyGroom, pose, lattice: null };
  }
}

const kTinyGroom: Groom = {
  name: "tiny",
  groupNames: ["hair"],
  points: Float32Array.of(0, 0, 0, 0, -kTinyM, 0),
  strands: {
    count: 1,
    begin: Uint32Array.of(0, 2),
    radiusM: Float32Array.of(kTinyM),
    hairCount: Float32Array.of(1),
    rootLengthM: Float32Array.of(0.01),
    group: Uint16Array.of(0),
    rooted: Uint8Array.of(1),
  },
  material: null,
  groupMaterials: [],
  rootBlends: [],
  clumps: [],
  threads: [],
  cards: [],
  cloths: [],
  knots: [],
  farCards: { points: new Float32Array(0), cards: [] },
  body: {
    vertices: Float32Array.of(0, 0, 0, kTinyM, 0, 0, 0, kTinyM, 0),
    boneWeights: Float32Array.of(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0),
    triangles: Uint32Array.of(0, 1, 2),
    joints: new Float32Array(15),
    fittedFromRoots: false,
  },
};
