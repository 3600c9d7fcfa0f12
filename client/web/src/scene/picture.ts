import {
  DepthFormat,
  DepthStencilFormat,
  DepthTexture,
  HalfFloatType,
  LinearFilter,
  Matrix4,
  NearestFilter,
  RedFormat,
  UnsignedInt248Type,
  UnsignedIntType,
  Vector2,
  Vector3,
  WebGLRenderTarget,
  type Camera,
  type ColorSpace,
  type IUniform,
  type Object3D,
  type Scene,
  type WebGLRenderer,
} from "three";
import { kMovingMax } from "../generated/constants";
import type { HairMotion } from "./hairMotion";
import type { HairScene } from "./hairScene";
import { drawAside, Pass } from "./pass";

/** Sample offsets within a pixel repeat after this number of frames; client/render/picture.cpp has the same number. */
const kPlaces = 32;
/**
 * A camera that turns by more than 0.6 rad or moves by more than 1 m between two frames has jumped: the average starts
 * again. client/render/picture.cpp has the same limits.
 */
const kCutCosine = Math.cos(0.6);
const kCutM = 1;

/** The camera of the last picture. */
interface CameraBefore {
  readonly camera: Camera;
  readonly sceneToClip: Matrix4;
  readonly position: Vector3;
  readonly forward: Vector3;
}

/**
 * Draws without grain: `render` replaces `renderer.render`. Each picture is drawn a little aside of the one before, and
 * is added to the average of those before it, which follows the motion of the camera, of heads and of their hair
 * (client/shaders/accumulate.frag). Colours and the background stay as they are without it. In a headset, and where the
 * GPU cannot draw into floats, it draws like `renderer.render`.
 */
export class Picture {
  readonly #renderer: WebGLRenderer;
  readonly #accumulate: Pass;
  readonly #present: Pass;
  /** The average that the screen gets: the uniform of present.frag. */
  readonly #average: IUniform = { value: null };
  /** The uniforms of accumulate.frag. */
  readonly #uniforms: Record<string, IUniform>;
  /** The GPU can draw into floats, as averages need. */
  readonly #canAverage: boolean;
  #targets: Targets | null = null;
  /** The camera of the picture before; null: there is none since the last cut. */
  #before: CameraBefore | null = null;
  /** The scene of the picture before. A picture of another scene begins with a cut. */
  #scene: Object3D | null = null;
  /** The pictures since the last cut, which is also the number of the next one. */
  #number = 0;

  constructor(renderer: WebGLRenderer) {
    this.#renderer = renderer;
    this.#canAverage =
      renderer.extensions.has("EXT_color_buffer_float") || renderer.extensions.has("EXT_color_buffer_half_float");
    this.#uniforms = {
      current: { value: null },
      depth: { value: null },
      history: { value: null },
      history_count: { value: null },
      jitter: { value: new Vector2() },
      to_scene: { value: new Matrix4() },
      to_clip_before: { value: new Matrix4() },
      moving_count: { value: 0 },
      to_head: { value: Array.from({ length: kMovingMax }, () => new Matrix4()) },
      head_to_clip_before: { value: Array.from({ length: kMovingMax }, () => new Matrix4()) },
      radius_m: { value: new Float32Array(kMovingMax) },
      swing: { value: null },
    };
    this.#accumulate = new Pass("screen.vert", "accumulate.frag", this.#uniforms);
    this.#present = new Pass("screen.vert", "present.frag", { average: this.#average });
    renderer.domElement.addEventListener("webglcontextrestored", this.#onRestored);
  }

  /** Pictures since the last cut. */
  get pictures(): number {
    return this.#number;
  }

  /**
   * Draws to the canvas; call `hair.update(camera)` before it. `hair` may be null: then nothing but the camera is known
   * to move.
   */
  render(scene: Scene, camera: Camera, hair: HairScene | null): void {
    const renderer = this.#renderer;
    if (!this.#canAverage || renderer.xr.isPresenting || renderer.getRenderTarget() !== null) {
      this.cut();
      renderer.render(scene, camera);
      return;
    }
    if (scene.matrixWorldAutoUpdate) scene.updateMatrixWorld();
    if (camera.parent === null) camera.updateMatrixWorld();
    const targets = this.#resize();
    const now = cameraOf(camera);
    if (this.#scene !== scene || (this.#before && isCut(this.#before, now))) this.cut();
    this.#scene = scene;

    const place = placeOf(this.#number).divide(new Vector2(targets.width, targets.height));
    // With multisampling the samples already spread over the pixel, and half the shift covers the rest of it evenly.
    if (targets.current.samples > 1) place.multiplyScalar(0.5);
    if (hair) hair.ditherSeed = this.#number;
    const back = shift(camera, place);
    try {
      renderer.setRenderTarget(targets.current);
      if (!renderer.autoClear) renderer.clear();
      renderer.render(scene, camera);
      this.#setUniforms(targets, camera, now, hair?.motion ?? null, place);
    } finally {
      back();
      if (hair) hair.ditherSeed = 0;
      renderer.setRenderTarget(null);
    }
    const isCounted = renderer.info.autoReset;
    // The passes below must not overwrite the statistics of the scene, which programs read from `renderer.info`.
    renderer.info.autoReset = false;
    this.#average.value = targets.next.textures[0];
    drawAside(renderer, () => {
      renderer.setRenderTarget(targets.next);
      this.#accumulate.draw(renderer, 3);
      renderer.setRenderTarget(null);
      this.#present.draw(renderer, 3);
    });
    renderer.info.autoReset = isCounted;
    targets.swap();
    this.#before = now;
    this.#number += 1;
  }

  /** Forgets all pictures before: the next one shows nothing of them. A jump of the camera does this by itself. */
  cut(): void {
    this.#before = null;
    this.#number = 0;
  }

  /** Frees its GPU memory. */
  dispose(): void {
    this.#renderer.domElement.removeEventListener("webglcontextrestored", this.#onRestored);
    this.#targets?.dispose();
    this.#targets = null;
    this.#accumulate.dispose();
    this.#present.dispose();
    this.cut();
  }

  readonly #onRestored = () => this.cut();

  #resize(): Targets {
    const size = this.#renderer.getDrawingBufferSize(new Vector2());
    if (this.#targets?.width !== size.x || this.#targets.height !== size.y) {
      this.#targets?.dispose();
      this.#targets = new Targets(this.#renderer, size.x, size.y);
      this.cut();
    }
    return this.#targets;
  }

  /** Sets the uniforms of accumulate.frag. `jitter`: by how much this frame is shifted, as a share of the picture. */
  #setUniforms(targets: Targets, camera: Camera, now: CameraBefore, motion: HairMotion | null, jitter: Vector2): void {
    const all = this.#uniforms;
    all.current.value = targets.current.texture;
    all.depth.value = targets.current.depthTexture;
    all.history.value = targets.last.textures[0];
    all.history_count.value = targets.last.textures[1];
    all.jitter.value.copy(jitter);
    // Scene space has the camera as its origin, where floats are precise.
    const fromCamera = new Matrix4().makeTranslation(now.position);
    const toCamera = new Matrix4().makeTranslation(now.position.clone().negate());
    all.to_scene.value.multiplyMatrices(camera.matrixWorld, camera.projectionMatrixInverse).premultiply(toCamera);
    const before = this.#before;
    // A matrix of zeros puts every point outside of the history (its w is 0), so the first frame is shown alone.
    if (before) all.to_clip_before.value.multiplyMatrices(before.sceneToClip, fromCamera);
    else all.to_clip_before.value.elements.fill(0);
    // `motions` measures from its last call, so every frame calls it, also a frame that cannot use the result.
    const motions = motion?.motions() ?? [];
    all.moving_count.value = 0;
    if (!before || !motion) return;
    all.swing.value = motion.swing;
    all.moving_count.value = motions.length;
    for (const [n, one] of motions.entries()) {
      all.to_head.value[n].copy(one.headToScene).premultiply(toCamera).invert();
      all.head_to_clip_before.value[n].multiplyMatrices(before.sceneToClip, one.headToSceneBefore);
      all.radius_m.value[n] = one.ballRadiusM;
    }
  }
}

/**
 * The textures of a picture: this frame, its average with the frames before (`next`), and the last average (`last`).
 */
class Targets {
  readonly current: WebGLRenderTarget;
  next: WebGLRenderTarget;
  last: WebGLRenderTarget;

  constructor(
    renderer: WebGLRenderer,
    readonly width: number,
    readonly height: number,
  ) {
    const { antialias, stencil } = renderer.getContextAttributes();
    const depthTexture = new DepthTexture(width, height);
    depthTexture.format = stencil ? DepthStencilFormat : DepthFormat;
    depthTexture.type = stencil ? UnsignedInt248Type : UnsignedIntType;
    depthTexture.minFilter = depthTexture.magFilter = NearestFilter;
    this.current = new WebGLRenderTarget(width, height, {
      // An antialiased canvas is taken to have 4 samples a pixel, as in hairMaterials.ts.
      samples: antialias ? 4 : 0,
      stencilBuffer: stencil === true,
      depthTexture,
      minFilter: NearestFilter,
      magFilter: NearestFilter,
      // Bytes in the display's encoding, as the canvas has them: with `isXRRenderTarget` three.js writes colours as it
      // writes them to the screen.
      internalFormat: "RGBA8",
      colorSpace: renderer.outputColorSpace as ColorSpace,
    });
    Object.assign(this.current, { isXRRenderTarget: true });
    this.next = averageTarget(width, height);
    this.last = averageTarget(width, height);
  }

  swap(): void {
    [this.next, this.last] = [this.last, this.next];
  }

  dispose(): void {
    this.current.depthTexture?.dispose();
    for (const target of [this.current, this.next, this.last]) target.dispose();
  }
}

// A target of two textures: the average of the frames, and for each pixel the number of frames in it. The average has
// half floats, because bytes would round away what one frame adds to an average of 32.
function averageTarget(width: number, height: number): WebGLRenderTarget {
  const target = new WebGLRenderTarget(width, height, {
    count: 2,
    type: HalfFloatType,
    depthBuffer: false,
    minFilter: LinearFilter,
    magFilter: LinearFilter,
  });
  target.textures[1].format = RedFormat;
  target.textures[1].minFilter = target.textures[1].magFilter = NearestFilter;
  return target;
}

function cameraOf(camera: Camera): CameraBefore {
  return {
    camera,
    sceneToClip: new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse),
    position: new Vector3().setFromMatrixPosition(camera.matrixWorld),
    forward: camera.getWorldDirection(new Vector3()),
  };
}

function isCut(before: CameraBefore, now: CameraBefore): boolean {
  return (
    before.camera !== now.camera ||
    before.forward.dot(now.forward) < kCutCosine ||
    before.position.distanceTo(now.position) > kCutM
  );
}

// Shifts the camera's picture by a share of its size. Returns the function that shifts it back.
function shift(camera: Camera, by: Vector2): () => void {
  const { projectionMatrix, projectionMatrixInverse } = camera;
  const before = projectionMatrix.clone();
  const inverse = projectionMatrixInverse.clone();
  // Clip space is 2 wide and high, so a share of the size counts twice.
  projectionMatrix.premultiply(new Matrix4().makeTranslation(2 * by.x, 2 * by.y, 0));
  projectionMatrixInverse.copy(projectionMatrix).invert();
  return () => {
    projectionMatrix.copy(before);
    projectionMatrixInverse.copy(inverse);
  };
}

/** How far the samples of frame `number` are shifted, px, -0.5 to 0.5: Halton's sequence of bases 2 and 3. */
export function placeOf(number: number): Vector2 {
  const n = (number % kPlaces) + 1;
  return new Vector2(radicalInverse(n, 2) - 0.5, radicalInverse(n, 3) - 0.5);
}

// Mirrors the digits of `n` in `base` at the point: 6 is 110 in base 2, and becomes 0.011, which is 0.375.
function radicalInverse(n: number, base: number): number {
  let inverse = 0;
  for (let digit = 1 / base, left = n; left > 0; digit /= base, left = Math.floor(left / base))
    inverse += digit * (left % base);
  return inverse;
}
