import {
  ArrayCamera,
  CubeCamera,
  DirectionalLight,
  Frustum,
  Matrix4,
  Sphere,
  SpotLight,
  Vector2,
  Vector3,
  type Camera,
  type Object3D,
  type Vector4,
  type WebGLRenderer,
} from "three";
import { kHeadM, kScreenHeightMax } from "../generated/constants";
import type { Pose } from "../hair/pose";

/** A head nearer than this to the eye counts as if it were there, so that its size stays finite. */
const kDepthMinM = 0.05;

/** What a camera, an eye of a headset, or a shadow map sees. */
export interface View {
  readonly frustum: Frustum;
  readonly eye: Vector3;
  /** Null for a camera that sees all directions, such as a cube camera. */
  readonly forward: Vector3 | null;
  readonly widthPx: number;
  readonly heightPx: number;
  /** The pixels that a metre covers: at a distance of 1 m, or at any distance when the camera is orthographic. */
  readonly pxPerM: number;
  readonly isPerspective: boolean;
  /** The view belongs to a light's shadow map. */
  readonly isShadow?: boolean;
}

/** A camera that a picture is drawn from. */
export type AnyCamera = Camera | CubeCamera;

/**
 * Whether the numbers of a view are finite. The near and far planes do not count: a mirror's far plane may be infinite.
 */
export function isFiniteView({ eye, forward, frustum, pxPerM }: View): boolean {
  const numbers = [eye, forward, ...frustum.planes.slice(0, 4).map(({ normal }) => normal)].map((v) =>
    v ? v.x + v.y + v.z : 0,
  );
  return [...numbers, pxPerM].every(Number.isFinite);
}

/**
 * The views for a picture from `camera`: the camera itself, the parts of an array camera, or the eyes of a headset. Its
 * world matrix must be up to date.
 */
export function viewsOf(renderer: WebGLRenderer, camera: Camera): View[] {
  if (renderer.xr.isPresenting) return partsOf(renderer.xr.getCamera());
  if (camera instanceof ArrayCamera) return partsOf(camera);
  const size = renderer.getDrawingBufferSize(new Vector2());
  return [makeView(camera, size.x, size.y)];
}

/**
 * The views of further cameras: a second picture, a mirror, a cube map. The size of their pictures is not known here,
 * except for a cube camera's; it counts as that of the canvas.
 */
export function furtherViews(renderer: WebGLRenderer, cameras: readonly AnyCamera[]): View[] {
  const size = renderer.getDrawingBufferSize(new Vector2());
  return cameras.flatMap((camera) => {
    camera.updateWorldMatrix(true, true);
    if (camera instanceof CubeCamera) return [viewAround(camera)];
    return camera instanceof ArrayCamera ? partsOf(camera) : [makeView(camera, size.x, size.y)];
  });
}

/** The views of all lights of the scene that draw shadow maps. */
export function shadowViews(root: Object3D): View[] {
  const views: View[] = [];
  root.traverseVisible((object) => {
    if (!(object instanceof DirectionalLight || object instanceof SpotLight) || !object.castShadow) return;
    object.updateWorldMatrix(true, false);
    object.target.updateWorldMatrix(true, false);
    object.shadow.updateMatrices(object);
    const { x, y } = object.shadow.mapSize;
    views.push({ ...makeView(object.shadow.camera, x, y), isShadow: true });
  });
  return views;
}

function partsOf(camera: ArrayCamera): View[] {
  return camera.cameras.map((part) => {
    const { z, w } = (part as { viewport?: Vector4 }).viewport ?? { z: 1, w: 1 };
    return makeView(part, z, w);
  });
}

function makeView(camera: Camera, widthPx: number, heightPx: number): View {
  const toView = new Matrix4().copy(camera.matrixWorld).invert();
  const { elements } = camera.projectionMatrix;
  const frustum = new Frustum().setFromProjectionMatrix(toView.premultiply(camera.projectionMatrix));
  // A mirror's camera has the mirror as its near plane, for which it changes these elements of the projection. Its far
  // plane is skewed by this, so nothing counts as too far away.
  if (elements[2] !== 0 || elements[6] !== 0) frustum.planes[4].constant = Infinity;
  return {
    frustum,
    eye: new Vector3().setFromMatrixPosition(camera.matrixWorld),
    forward: new Vector3(0, 0, -1).transformDirection(camera.matrixWorld),
    widthPx,
    heightPx,
    pxPerM: 0.5 * heightPx * Math.abs(elements[5]),
    isPerspective: elements[15] === 0,
  };
}

/** A cube camera sees in all directions; a head in the middle of a face is the largest. */
function viewAround(camera: CubeCamera): View {
  const frustum = new Frustum();
  for (const plane of frustum.planes) plane.constant = Infinity;
  const { width, height } = camera.renderTarget;
  return {
    frustum,
    eye: new Vector3().setFromMatrixPosition(camera.matrixWorld),
    forward: null,
    widthPx: width,
    heightPx: height,
    pxPerM: 0.5 * height,
    isPerspective: true,
  };
}

/** How large a head is in the views; of several views the largest. */
export interface Seen {
  /** The height of the head, pixels. */
  headPx: number;
  /** The height of the head over the view's height. */
  screenHeight: number;
  /** Any part of the character is in a view. */
  inView: boolean;
}

/**
 * How a head is seen by these views. `pose`: scene space; `radius`: of a ball about the head that contains the
 * character, m; `size`: the character's scale.
 */
export function seenBy(views: readonly View[], pose: Pose, radius: number, size: number): Seen {
  const head = new Vector3(pose[4], pose[5], pose[6]);
  const ball = new Sphere(head, radius);
  let headPx = 0;
  let screenHeight = 0;
  let inView = false;
  for (const view of views) {
    const away = head.clone().sub(view.eye);
    const depth = view.forward ? away.dot(view.forward) : away.length();
    const px = (size * kHeadM * view.pxPerM) / (view.isPerspective ? Math.max(depth, kDepthMinM) : 1);
    headPx = Math.max(headPx, px);
    screenHeight = Math.max(screenHeight, px / Math.max(view.heightPx, 1));
    inView ||= view.frustum.intersectsSphere(ball);
  }
  return { headPx, screenHeight: Math.min(screenHeight, kScreenHeightMax), inView };
}

/**
 * How a character is drawn for all views: for the largest among those that see it. One that only a shadow map sees is
 * drawn for its distance from the first view.
 */
export function drawnIn(views: readonly View[], pose: Pose, radius: number, size: number): Seen {
  const seeing = views.filter((view) => !view.isShadow && seenBy([view], pose, radius, size).inView);
  if (seeing.length > 0) return seenBy(seeing, pose, radius, size);
  const inView = seenBy(views, pose, radius, size).inView;
  const around = views.slice(0, 1).map((view) => ({ ...view, forward: null }));
  return { ...seenBy(around, pose, radius, size), inView };
}
