import {
  BoxGeometry,
  Color,
  Group,
  MathUtils,
  Mesh,
  MeshBasicMaterial,
  PerspectiveCamera,
  PlaneGeometry,
  Vector3,
  type Camera,
} from "three";
import { Reflector } from "three/addons/objects/Reflector.js";

/** The glass of the mirror, and the width of its frame. */
const kWidthM = 0.62;
const kHeightM = 0.86;
const kFrameM = 0.025;
/** The mirror stands this far in front of the head joint. */
const kBeforeFaceM = 0.55;
/** The height of the reflected picture; its width is in proportion. */
const kPixels = 1024;
/** The camera of the reflection stays at least this far behind the glass: from nearer it would see half a world. */
const kNearestM = 0.05;

/** A mirror that stands before the own face. */
export class Mirror extends Group {
  readonly #glass = new Reflector(new PlaneGeometry(kWidthM, kHeightM), {
    textureWidth: (kPixels * kWidthM) / kHeightM,
    textureHeight: kPixels,
    multisample: 4,
    // With this grey a Reflector is as bright as what it reflects.
    color: new Color(0.5, 0.5, 0.5),
  });
  readonly #frame = new Mesh(
    new BoxGeometry(kWidthM + 2 * kFrameM, kHeightM + 2 * kFrameM, 0.02),
    new MeshBasicMaterial({ color: 0x2a2420 }),
  );

  /** `head`: the head joint, world; `heading`: where the face looks, about +Y from +Z. */
  constructor(head: Vector3, heading: number) {
    super();
    this.#frame.position.z = -0.012;
    this.add(this.#frame, this.#glass);
    this.position.copy(head).add(new Vector3(Math.sin(heading), 0, Math.cos(heading)).multiplyScalar(kBeforeFaceM));
    // The glass is on the side of +Z, which faces the head.
    this.rotation.y = heading + Math.PI;
  }

  /**
   * A camera that sees at least what `viewer` sees in the glass. Give it to `HairScene.update`, which leaves out hair
   * that no camera sees: the glass shows people who are not in the viewer's picture.
   */
  cameraFor(viewer: Camera): PerspectiveCamera {
    this.updateWorldMatrix(true, true);
    const eye = this.worldToLocal(viewer.getWorldPosition(new Vector3()));
    // In the axes of the mirror the reflected eye lies behind the glass, at -z.
    eye.z = Math.min(-eye.z, -kNearestM);
    const camera = new PerspectiveCamera();
    camera.position.copy(this.localToWorld(eye.clone()));
    camera.lookAt(this.getWorldPosition(new Vector3()));
    // The camera looks at the middle of the glass, with a square view that contains the circle about all its corners.
    camera.fov = 2 * MathUtils.RAD2DEG * Math.atan2(0.5 * Math.hypot(kWidthM, kHeightM), eye.length());
    camera.far = 100;
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
    return camera;
  }

  override dispose(): void {
    this.removeFromParent();
    this.#glass.dispose();
    this.#glass.geometry.dispose();
    this.#frame.geometry.dispose();
    this.#frame.material.dispose();
  }
}
