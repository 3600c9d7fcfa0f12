import { CanvasTexture, Group, PerspectiveCamera, Scene, SRGBColorSpace, Vector3, WebGLRenderer } from "three";
import { Picture } from "../src/scene/index";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

const kPixelRatioMax = 2;
export const kHeadInVrM = 1.6;

/** Renderer, camera and an empty room. */
export class Stage {
  readonly renderer: WebGLRenderer;
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera(30, 1, 0.02, 100);
  /** Carries the camera in VR: the place of its floor. */
  readonly rig = new Group();
  readonly orbit: OrbitControls;
  /** Draws without grain. */
  readonly picture: Picture;
  isLost = false;
  /** The user has turned or moved the view. */
  isMoved = false;
  #headY = kHeadInVrM;

  constructor(
    readonly canvas: HTMLCanvasElement,
    /** the pixels at the right and the bottom that controls cover */
    private readonly covered: () => { right: number; bottom: number },
  ) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, powerPreference: "high-performance" });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, kPixelRatioMax));
    this.picture = new Picture(this.renderer);
    this.renderer.xr.enabled = true;
    this.renderer.xr.setReferenceSpaceType("local-floor");
    this.scene.background = backdrop();
    this.rig.add(this.camera);
    this.scene.add(this.rig);
    this.camera.position.set(0.5, 0.1, 1.8);
    this.orbit = new OrbitControls(this.camera, canvas);
    this.orbit.target.set(0, -0.05, 0);
    this.orbit.enableDamping = true;
    this.orbit.minDistance = 0.25;
    this.orbit.maxDistance = 40;
    this.orbit.addEventListener("start", () => (this.isMoved = true));
    // A headset's floor is under the feet of other characters; without a headset the camera is in the scene itself.
    this.renderer.xr.addEventListener("sessionstart", () => (this.rig.position.y = this.#headY - kHeadInVrM));
    this.renderer.xr.addEventListener("sessionend", () => {
      this.rig.position.y = 0;
      this.resize();
    });
    canvas.addEventListener("webglcontextlost", () => (this.isLost = true));
    canvas.addEventListener("webglcontextrestored", () => (this.isLost = false));
    addEventListener("resize", () => this.resize());
    this.resize();
  }

  resize(): void {
    if (this.renderer.xr.isPresenting) return;
    const { innerWidth: width, innerHeight: height } = window;
    const { right, bottom } = this.covered();
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    // Centres the camera's target in the uncovered part.
    this.camera.setViewOffset(width, height, Math.round(right / 2), Math.round(bottom / 2), width, height);
    this.camera.updateProjectionMatrix();
  }

  /** Frames all these heads (world); the direction of the view stays. */
  frame(heads: readonly Vector3[]): void {
    if (heads.length === 0) return;
    const middle = heads.reduce((sum, head) => sum.add(head), new Vector3()).divideScalar(heads.length);
    const radius = 0.36 + heads.reduce((most, head) => Math.max(most, head.distanceTo(middle)), 0);
    const { right, bottom } = this.covered();
    const half = Math.tan((this.camera.fov * Math.PI) / 360);
    const free = { x: 1 - right / innerWidth, y: 1 - bottom / innerHeight };
    const distance = radius / Math.min(half * free.y, half * this.camera.aspect * free.x);
    const from = this.camera.position.clone().sub(this.orbit.target).normalize();
    this.orbit.target.copy(middle).y -= 0.08;
    this.camera.position.copy(this.orbit.target).addScaledVector(from, distance);
    this.orbit.update();
  }

  /** Sets the floor in VR so that heads at `headY` have the height of a standing person. */
  standAt(headY: number): void {
    this.#headY = headY;
  }
}

/** A soft gradient, lighter behind the heads. */
function backdrop(): CanvasTexture {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 256;
  const context = canvas.getContext("2d")!;
  const gradient = context.createRadialGradient(128, 110, 10, 128, 128, 190);
  gradient.addColorStop(0, "#5b5d66");
  gradient.addColorStop(0.55, "#37393f");
  gradient.addColorStop(1, "#1b1c20");
  context.fillStyle = gradient;
  context.fillRect(0, 0, 256, 256);
  const texture = new CanvasTexture(canvas);
  texture.colorSpace = SRGBColorSpace;
  return texture;
}
