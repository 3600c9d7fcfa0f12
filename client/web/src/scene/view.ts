import { Frustum, Matrix4, Sphere, Vector2, Vector3, type Camera, type WebGLRenderer } from "three";
import { kHeadM } from "../generated/constants";
import type { Pose } from "../hair/pose";

const kScreenHeightMax = 100; // the limit of servers

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

/**
 * The views for a picture from `camera`: the camera itself, or the eyes of a headset. Its world matrix must be up to
 * date.
 */
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

/** The appearance of a head; the largest over the views. */
export interface Seen {
  headPx: number;
  /** height of the head over the view's height */
  screenHeight: number;
  inView: boolean;
}

/** `pose`: scene; `radius`: of everything that belongs to it, about the head; `size`: its scale. */
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
