import { Frustum, Matrix4, Sphere, Vector2, Vector3, type Camera, type WebGLRenderer } from "three";
import { kHeadM } from "../generated/constants";
import type { Pose } from "../hair/pose";

const kScreenHeightMax = 100; // that servers take

/** A camera, or one eye. */
export interface View {
  readonly frustum: Frustum;
  readonly eye: Vector3;
  readonly forward: Vector3;
  readonly widthPx: number;
  readonly heightPx: number;
  /** of a metre at 1 m, or of any metre when the camera is orthographic */
  readonly pxPerM: number;
  readonly isPerspective: boolean;
}

/** What a picture from `camera` will be seen by: itself, or the eyes of a headset. Its world matrix is up to date. */
export function viewsOf(renderer: WebGLRenderer, camera: Camera): View[] {
  if (renderer.xr.isPresenting) {
    const { cameras } = renderer.xr.getCamera();
    return cameras.map((eye) => makeView(eye, eye.viewport?.z ?? 1, eye.viewport?.w ?? 1));
  }
  const size = renderer.getDrawingBufferSize(new Vector2());
  return [makeView(camera, size.x, size.y)];
}

function makeView(camera: Camera, widthPx: number, heightPx: number): View {
  const toView = new Matrix4().copy(camera.matrixWorld).invert();
  return {
    frustum: new Frustum().setFromProjectionMatrix(toView.premultiply(camera.projectionMatrix)),
    eye: new Vector3().setFromMatrixPosition(camera.matrixWorld),
    forward: new Vector3(0, 0, -1).transformDirection(camera.matrixWorld),
    widthPx,
    heightPx,
    pxPerM: 0.5 * heightPx * camera.projectionMatrix.elements[5],
    isPerspective: camera.projectionMatrix.elements[15] === 0,
  };
}

/** How a head is seen; the largest over the views. */
export interface Seen {
  headPx: number;
  /** of the head, over the view's */
  screenHeight: number;
  inView: boolean;
}

/** `pose`: scene; `radius`: of all that belongs to it, about the head; `size`: by how much it is enlarged. */
export function seenBy(views: readonly View[], pose: Pose, radius: number, size: number): Seen {
  const head = new Vector3(pose[4], pose[5], pose[6]);
  const ball = new Sphere(head, radius);
  let headPx = 0;
  let screenHeight = 0;
  let inView = false;
  for (const view of views) {
    const depth = head.clone().sub(view.eye).dot(view.forward);
    const px = (size * kHeadM * view.pxPerM) / (view.isPerspective ? Math.max(depth, 0.05) : 1);
    headPx = Math.max(headPx, px);
    screenHeight = Math.max(screenHeight, px / Math.max(view.heightPx, 1));
    inView ||= view.frustum.intersectsSphere(ball);
  }
  return { headPx, screenHeight: Math.min(screenHeight, kScreenHeightMax), inView };
}
