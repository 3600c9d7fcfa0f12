// A three.js scene with one head, for light.e2e.ts: it has a ground, a mirror and a second camera.
import {
  AmbientLight,
  Color,
  DirectionalLight,
  Mesh,
  MeshStandardMaterial,
  PerspectiveCamera,
  PlaneGeometry,
  PMREMGenerator,
  Scene,
  WebGLRenderer,
  type Camera,
} from "three";
import { RoomEnvironment } from "three/addons/environments/RoomEnvironment.js";
import { Reflector } from "three/addons/objects/Reflector.js";
import { rigidPose } from "../src/hair/pose";
import { Groom } from "../src/hair/groom";
import { HairScene, type HairSceneOptions, type HairSource, type MovedLattice } from "../src/scene/index";
import { latticeOf } from "../test/support/shapes";

/** The width and height of the canvas, pixels. */
const kSize = 400;

/** One head at `at`, whose hair follows `displace` (head space). */
class OneHead implements HairSource {
  lattice: MovedLattice | null = null;
  constructor(
    readonly groom: Groom,
    readonly at: readonly [number, number, number],
  ) {}

  sample() {
    const pose = rigidPose([0, 0, 0, 1], [...this.at]);
    return [{ member: 1, own: false, groomKey: "a", groom: this.groom, pose, lattice: this.lattice }];
  }

  /** Moves every point x by displace(x), approximately: through a lattice about the head. */
  move(displace: (x: number, y: number, z: number) => [number, number, number]): void {
    // The lattice goes from -0.45 to 0.45 m in x and z and from -0.9 to 0.4 m in y: around a head with long hair.
    const lattice = latticeOf([10, 14, 10], 0.1, [-0.45, -0.9, -0.45]);
    const grid = new Float32Array(3 * 10 * 14 * 10);
    for (let n = 0; n < grid.length / 3; ++n) {
      const [i, j, k] = [n % 10, Math.floor(n / 10) % 14, Math.floor(n / 140)];
      grid.set(displace(-0.45 + 0.1 * i, -0.9 + 0.1 * j, -0.45 + 0.1 * k), 3 * n);
    }
    this.lattice = { lattice, grid };
  }
}

/** The picture of a set-up: its pixels from the top left. */
export interface Shot {
  pixels: Uint8ClampedArray;
  size: number;
}

export class LightStage {
  readonly canvas = document.createElement("canvas");
  readonly renderer = new WebGLRenderer({ canvas: this.canvas, antialias: true, preserveDrawingBuffer: true });
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera(35, 1, 0.05, 50);
  readonly sun = new DirectionalLight(0xffffff, 3);
  readonly ground = new Mesh(new PlaneGeometry(4, 4), new MeshStandardMaterial({ color: 0xc0c0c0 }));
  readonly head: OneHead;
  readonly hair: HairScene;

  /** `groom`: the address of a file. */
  static async open(
    groom: string,
    options: HairSceneOptions,
    at: readonly [number, number, number] = [0, 1.2, 0],
  ): Promise<LightStage> {
    const bytes = await (await fetch(groom)).arrayBuffer();
    return new LightStage(await Groom.load(bytes), options, at);
  }

  constructor(groom: Groom, options: HairSceneOptions, at: readonly [number, number, number]) {
    this.renderer.setSize(kSize, kSize, false);
    this.renderer.shadowMap.enabled = true;
    this.scene.background = new Color(0x506070);
    this.head = new OneHead(groom, at);
    this.hair = new HairScene(this.head, this.renderer, options);
    this.sun.position.set(0.6, 4, 1);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(1024, 1024);
    // The shadow map covers 1.2 m to each side, at distances from 0.5 to 8 m from the sun: the head and its shadow.
    Object.assign(this.sun.shadow.camera, { left: -1.2, right: 1.2, top: 1.2, bottom: -1.2, near: 0.5, far: 8 });
    this.ground.rotation.x = -Math.PI / 2;
    this.ground.receiveShadow = true;
    this.scene.add(this.hair, this.sun, this.ground, new AmbientLight(0xffffff, 0.6));
    this.camera.position.set(0, 2.2, 3.2);
    this.camera.lookAt(0, 0.7, 0);
    document.body.append(this.canvas);
  }

  /** Waits until the head can be drawn. */
  async ready(): Promise<void> {
    for (;;) {
      this.hair.update(this.camera);
      if (this.hair.characters.get(1)?.isReady) return;
      await new Promise((done) => setTimeout(done, 20));
    }
  }

  /** Adds a mirror behind the head. */
  addMirror(): Reflector {
    const mirror = new Reflector(new PlaneGeometry(2, 2), {
      textureWidth: kSize,
      textureHeight: kSize,
      multisample: 4,
    });
    this.scene.add(mirror);
    return mirror;
  }

  /** Draws the scene from the camera, and returns the picture. */
  shoot(camera: Camera = this.camera): Shot {
    this.renderer.render(this.scene, camera);
    const copy = document.createElement("canvas");
    copy.width = copy.height = kSize;
    const context = copy.getContext("2d", { willReadFrequently: true })!;
    context.drawImage(this.canvas, 0, 0);
    return { pixels: context.getImageData(0, 0, kSize, kSize).data, size: kSize };
  }

  /** The scene's environment becomes three.js's room. */
  useRoom(): void {
    this.scene.environment = new PMREMGenerator(this.renderer).fromScene(new RoomEnvironment(), 0.04).texture;
  }

  dispose(): void {
    this.hair.dispose();
    this.renderer.dispose();
    this.canvas.remove();
  }
}

Object.assign(window, { LightStage });
