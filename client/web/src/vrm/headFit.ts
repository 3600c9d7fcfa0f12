import type { VRM } from "@pixiv/three-vrm";
import { Matrix4, Mesh, SkinnedMesh, Vector3, type Object3D } from "three";
import type { Groom } from "../hair/groom";
import { isBelow } from "./isBelow";
import { heaviest } from "./vrmHairMeshes";
import { atRest } from "./vrmSkeleton";

/** How a groom made on one head fits another: x on that head = size * x + offset, head space, m. */
export interface HeadFit {
  readonly size: number;
  readonly offset: readonly [number, number, number];
}

export const kNoFit: HeadFit = { size: 1, offset: [0, 0, 0] };

/** The upper part of a skull. */
interface Skull {
  readonly top: number;
  readonly widthX: number;
  readonly widthZ: number;
  readonly middleZ: number;
}

const kSizeMin = 0.5;
const kSizeMax = 2;

/**
 * Scales the groom's skull evenly until it is as wide and as deep as the model's above the ears (by the larger of the
 * two ratios, so that hair does not sink in), and moves it so that the crowns meet and both have the same middle from
 * front to back. A part that cannot be measured does not change the fit. `hidden`: meshes that do not belong to the
 * skull.
 */
export function fitHead(groom: Groom, vrm: VRM, anchor: Object3D, hidden: readonly Mesh[]): HeadFit {
  const from = skullOf(headPoints(groom));
  const to = skullOf(modelHeadPoints(vrm, anchor, hidden));
  if (!from || !to) return kNoFit;
  const size = Math.min(Math.max(to.widthX / from.widthX, to.widthZ / from.widthZ, kSizeMin), kSizeMax);
  return { size, offset: [0, to.top - size * from.top, to.middleZ - size * from.middleZ] };
}

/** The part of the groom's own body that moves with the head. */
function headPoints(groom: Groom): Vector3[] {
  const { vertices, boneWeights } = groom.body;
  const points: Vector3[] = [];
  for (let v = 0; v < vertices.length / 3; ++v)
    if (boneWeights[5 * v] > 0.9) points.push(new Vector3(vertices[3 * v], vertices[3 * v + 1], vertices[3 * v + 2]));
  return points;
}

/** The vertices of all visible meshes that belong to the head bone itself, in head space at rest. */
function modelHeadPoints(vrm: VRM, anchor: Object3D, hidden: readonly Mesh[]): Vector3[] {
  const head = vrm.humanoid.getRawBoneNode("head");
  return atRest(vrm, () => {
    const toHead = new Matrix4().copy(anchor.matrixWorld).invert();
    const points: Vector3[] = [];
    vrm.scene.traverse((object) => {
      if (!(object instanceof Mesh) || hidden.includes(object)) return;
      const count = object.geometry.attributes.position?.count ?? 0;
      for (let v = 0; v < count; ++v) {
        if (object instanceof SkinnedMesh && object.skeleton.bones[heaviest(object, v)] !== head) continue;
        if (!(object instanceof SkinnedMesh) && !isBelow(object, head)) break;
        points.push(object.getVertexPosition(v, new Vector3()).applyMatrix4(object.matrixWorld).applyMatrix4(toHead));
      }
    });
    return points;
  });
}

function skullOf(points: readonly Vector3[]): Skull | null {
  const top = points.reduce((most, p) => Math.max(most, p.y), -Infinity);
  const upper = points.filter((p) => p.y > 0.45 * top);
  if (!(top > 0.02) || upper.length < 4) return null;
  const xs = upper.map((p) => p.x);
  const zs = upper.map((p) => p.z);
  const low = (values: number[]) => values.reduce((a, b) => Math.min(a, b));
  const high = (values: number[]) => values.reduce((a, b) => Math.max(a, b));
  const widthX = high(xs) - low(xs);
  const widthZ = high(zs) - low(zs);
  return widthX > 0.01 && widthZ > 0.01 ? { top, widthX, widthZ, middleZ: 0.5 * (low(zs) + high(zs)) } : null;
}
