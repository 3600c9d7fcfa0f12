import {
  Group,
  MathUtils,
  PerspectiveCamera,
  type Ray,
  Raycaster,
  Scene,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { Picture, type HairScene } from "../src/scene/index";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { CameraMotion } from "./cameraMotion";
import { FirstPictures } from "./firstPictures";
import { type Covered, distanceFor, freePart, type Size } from "./framing";
import { ShaderWarmUp } from "./shaderWarmUp";
import { fadeBust, type Standing, Surroundings } from "./surroundings";

/** At most this many device pixels are drawn for each CSS pixel on a side. */
const kPixelRatioMax = 2;
/** The height of a standing person's head joint above the floor, m. */
export const kHeadInVrM = 1.6;
/** The camera looks down by this angle, from slightly above the heads, so that the ground is in the picture. */
export const kViewHeightRad = 0.1;

/** Renderer, camera, and what is around the people. */
export class Stage {
  readonly renderer: WebGLRenderer;
  readonly scene = new Scene();
  // The field of view is narrow, 30 degrees, as for a portrait. With the near plane at 2 cm, hair before the eyes is in
  // the picture of first person.
  readonly camera = new PerspectiveCamera(30, 1, 0.02, 100);
  /** Carries the camera in VR: the place of its floor. */
  readonly rig = new Group();
  readonly orbit: OrbitControls;
  /** Draws without grain. */
  readonly picture: Picture;
  readonly motion: CameraMotion;
  readonly surroundings = new Surroundings();
  readonly firstPictures = new FirstPictures();
  /** The browser has taken the WebGL context away; nothing can be drawn until it is back. */
  isLost = false;
  /** The user has turned or moved the view. */
  isMoved = false;
  /** The mean height of the heads in the room, world, m. */
  #headY = kHeadInVrM;
  /** The factor on the picture's width and height that the first pictures have (`FirstPictures.share`). */
  #share = 1;
  /** What the last picture without people depended on (`#backdropOf`), or "" when the next picture must be drawn. */
  #backdrop = "";
  #warmUp: ShaderWarmUp | null = null;

  constructor(
    readonly canvas: HTMLCanvasElement,
    /** Returns the CSS pixels at the right and the bottom of the view that controls cover. */
    private readonly covered: () => Covered,
  ) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, powerPreference: "high-performance" });
    this.picture = new Picture(this.renderer);
    this.renderer.xr.enabled = true;
    this.renderer.xr.setReferenceSpaceType("local-floor");
    this.rig.add(this.camera);
    this.scene.add(this.rig, this.surroundings);
    this.camera.position.set(0.5, kHeadInVrM + 0.2, 1.8);
    this.orbit = new OrbitControls(this.camera, canvas);
    this.orbit.target.set(0, kHeadInVrM, 0);
    this.orbit.enableDamping = true;
    // Nearer than 25 cm the camera would be in the hair, and beyond 40 m heads are hardly seen.
    this.orbit.minDistance = 0.25;
    this.orbit.maxDistance = 40;
    // Below the ground there is nothing to see.
    this.orbit.maxPolarAngle = 0.6 * Math.PI;
    this.motion = new CameraMotion(this.camera, this.orbit);
    this.orbit.addEventListener("start", () => (this.isMoved = true));
    // A headset's floor is under the feet of other characters; without a headset the camera is in the scene itself.
    this.renderer.xr.addEventListener("sessionstart", () => (this.rig.position.y = this.#headY - kHeadInVrM));
    this.renderer.xr.addEventListener("sessionend", () => {
      this.rig.position.y = 0;
      this.resize();
    });
    canvas.addEventListener("webglcontextlost", () => (this.isLost = true));
    canvas.addEventListener("webglcontextrestored", () => {
      this.isLost = false;
      this.#backdrop = "";
    });
    addEventListener("resize", () => this.resize());
    this.resize();
  }

  get size(): Size {
    return { width: innerWidth, height: innerHeight };
  }

  /**
   * The quality for `HairScene` at which hair has the detail that `quality` means for all pixels, although the picture
   * has fewer pixels now.
   */
  detailFor(quality: number): number {
    return this.renderer.xr.isPresenting ? quality : quality / this.#share;
  }

  /** The angle that a CSS pixel spans in the picture's middle, rad. */
  get radPerPx(): number {
    return (2 * Math.tan((this.camera.fov / 2) * MathUtils.DEG2RAD)) / this.size.height;
  }

  /** The ray from the camera through a pointer, world. */
  rayAt({ clientX, clientY }: Pick<PointerEvent, "clientX" | "clientY">): Ray {
    const { width, height } = this.size;
    const caster = new Raycaster();
    caster.setFromCamera(new Vector2((2 * clientX) / width - 1, 1 - (2 * clientY) / height), this.camera);
    return caster.ray;
  }

  /** The size of the part of the view that no controls cover, which is at its left and top. */
  get free(): Size {
    return freePart(this.size, this.covered());
  }

  resize(): void {
    if (this.renderer.xr.isPresenting) return;
    const { width, height } = this.size;
    const { right, bottom } = this.covered();
    // A new size clears the canvas, so the backdrop must be drawn again.
    this.#backdrop = "";
    this.#share = this.#wantedShare;
    this.renderer.setPixelRatio(this.#pixelRatio * this.#share);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    // Centres the camera's target in the free part.
    this.camera.setViewOffset(width, height, Math.round(right / 2), Math.round(bottom / 2), width, height);
    this.camera.updateProjectionMatrix();
  }

  /** The camera's distance at which a box of this width and height (m) fits into the free part of the view. */
  distanceFor(box: Size): number {
    return distanceFor(box, this.camera.fov, this.size, this.free);
  }

  /** Flies to a view of all these heads (world); the direction of the view stays. */
  frame(heads: readonly Vector3[]): void {
    if (heads.length === 0) return;
    const middle = heads.reduce((sum, head) => sum.add(head), new Vector3()).divideScalar(heads.length);
    // `across` is to the right in the picture and `ahead` towards the camera, m from the middle of the heads. Hair and
    // shoulders need 0.5 m more in width and 0.8 m in height, and the middle of head and bust is 6 cm below the joint.
    const { bearing } = this.motion.view;
    const across = heads.map(({ x, z }) => (x - middle.x) * Math.cos(bearing) - (z - middle.z) * Math.sin(bearing));
    const ahead = heads.map(({ x, z }) => (x - middle.x) * Math.sin(bearing) + (z - middle.z) * Math.cos(bearing));
    const heights = heads.map(({ y }) => y - middle.y);
    const box = {
      width: 2 * Math.max(...across.map(Math.abs)) + 0.5,
      height: Math.max(...heights) - Math.min(...heights) + 0.8,
    };
    middle.y -= 0.06;
    const distance = this.distanceFor(box) + Math.max(...ahead);
    this.motion.flyTo({ target: middle, bearing, height: kViewHeightRad + 0.08, distance });
  }

  /** Sets the floor in VR so that heads at `headY` have the height of a standing person. */
  standAt(headY: number): void {
    this.#headY = headY;
  }

  get #pixelRatio(): number {
    return Math.min(devicePixelRatio, kPixelRatioMax);
  }

  get #wantedShare(): number {
    const { width, height } = this.size;
    return this.firstPictures.share({ width: this.#pixelRatio * width, height: this.#pixelRatio * height });
  }

  /**
   * Compiles the shaders of hair by drawing a tiny hairstyle (shaderWarmUp.ts). Call it before pictures without people,
   * while the first hair is on its way; after the first hair it does nothing.
   */
  warmUpShaders(): void {
    if (!this.firstPictures.isBeforeHair) return;
    this.#warmUp ??= new ShaderWarmUp(this.renderer, this.scene, this.camera, { onMaterial: fadeBust });
    this.#warmUp.draw();
  }

  /** Draws the scene. `people`: all who are visible. */
  draw(hair: HairScene | null, people: readonly Standing[]): void {
    const { free, size } = this;
    if (this.#wantedShare !== this.#share) this.resize();
    const ratio = this.renderer.getPixelRatio();
    const middle = new Vector2(free.width / 2, size.height - free.height / 2).multiplyScalar(ratio);
    this.surroundings.update(this.camera, hair?.rig ?? null, people, middle, ratio * Math.min(free.width, free.height));
    if (people.length > 0) {
      this.#backdrop = "";
      if (!this.firstPictures.isBeforeHair) return this.picture.render(this.scene, this.camera, hair);
      // The first picture with hair is not averaged: it has grain, and comes sooner. The warm-up's hair has kept the
      // shaders until now, and is not needed any more.
      this.renderer.render(this.scene, this.camera);
      this.#warmUp?.dispose();
      this.#warmUp = null;
      return;
    }
    // The first hair should come soon: a backdrop that stays the same is drawn once.
    const backdrop = this.#backdropOf(hair, free);
    if (backdrop !== "" && backdrop === this.#backdrop) return;
    this.#backdrop = backdrop;
    // Without hair there is no grain to average away. The average of earlier pictures ends here.
    this.picture.cut();
    this.renderer.render(this.scene, this.camera);
  }

  /** What a picture of the backdrop alone depends on; empty: there is something else in the picture. */
  #backdropOf(hair: HairScene | null, free: Size): string {
    const { camera, canvas, rig, scene, surroundings } = this;
    const isAlone = scene.children.every((child) => child === rig || child === surroundings || child === hair);
    if (!isAlone || this.renderer.xr.isPresenting) return "";
    // The backdrop is the same in all bearings, so only the camera's pitch counts.
    const up = camera.getWorldDirection(new Vector3()).y.toFixed(3);
    return [canvas.width, canvas.height, free.width, free.height, up].join();
  }
}
