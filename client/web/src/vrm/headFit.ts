import type { VRM } from "@pixiv/three-vrm";
import { Matrix3, Vector3, type Mesh, type Object3D } from "three";
import type { Groom } from "../hair/groom";
import { groomHeadTriangles, modelHeadTriangles } from "./headTriangles";
import { HeadSurface, kScalp, middleOf, type Triangles } from "./headSurface";

/** How a groom made on one head fits another: x on that head = size * x + offset, head space, m. */
export interface HeadFit {
  readonly size: number;
  readonly offset: readonly [number, number, number];
}

/** A change of a fit by hand. */
export interface HeadFitChange {
  /** The factor on the hair's size, about the middle of the skull. */
  readonly size?: number;
  /** How far the hair is moved up, m of the model. */
  readonly height?: number;
  /** How far the hair is moved towards the face, m of the model. */
  readonly depth?: number;
}

/** The fit that leaves a groom as it is. */
export const kNoFit: HeadFit = { size: 1, offset: [0, 0, 0] };

/** The fitted size over the ratio of the skulls' median radii lies in 1 / kSizeChange to kSizeChange. */
const kSizeChange = 1.3;
/** The middle of a groom's skull, head space, m. */
const kSkullMiddle = [0, 0.06, 0] as const;
/** Hair that is inside the head is worse than hair that is as far outside. */
const kBuriedWeight = 6;
/** The distance from the model's skull, as a share of its radius, beyond which a sample is an ear, a hat or a horn. */
const kOutlierShare = 0.2;
/** A head is measured only if at least this share of the directions of kScalp meets its surface. */
const kMeasuredShareMin = 0.3;

/**
 * Scales the groom's skull evenly and moves it, until the part of it that carries hair lies on the model's head. A
 * groom keeps its size and place where the model's head cannot be measured. Meshes of `hidden` and triangles of
 * `hairBones` do not belong to the model's skull.
 */
export function fitHead(
  groom: Pick<Groom, "body">,
  vrm: VRM,
  anchor: Object3D,
  hidden: readonly Mesh[],
  hairBones: ReadonlySet<Object3D> = new Set(),
): HeadFit {
  return fitTriangles(groomHeadTriangles(groom), modelHeadTriangles(vrm, anchor, hidden, hairBones));
}

/** `fit`, changed by hand. */
export function changedFit(fit: HeadFit, change: HeadFitChange): HeadFit {
  const { size = 1, height = 0, depth = 0 } = change;
  const by = [0, height, depth];
  const offset = kSkullMiddle.map((x, axis) => fit.offset[axis] + by[axis] + fit.size * (1 - size) * x);
  return { size: fit.size * size, offset: [offset[0], offset[1], offset[2]] };
}

function fitTriangles(from: Triangles, to: Triangles): HeadFit {
  const groomMiddle = middleOf(from);
  let middle = middleOf(to);
  if (!groomMiddle || !middle) return kNoFit;
  const groomSurface = new HeadSurface(from, groomMiddle);
  const skull = kScalp.flatMap((direction) => {
    const radius = groomSurface.radius(direction);
    return radius > 0 ? [direction.clone().multiplyScalar(radius).add(groomMiddle)] : [];
  });
  if (skull.length === 0) return kNoFit;
  const groomRadius = median(skull.map((point) => point.distanceTo(groomMiddle)));
  let fit: HeadFit = kNoFit;
  // Each pass measures from the middle that the previous one has found.
  // Four passes are the limit; they end when the middle moves by less than 0.5 % of the skull's radius.
  for (let pass = 0, change = Infinity; pass < 4 && change > 5e-3 * groomRadius * fit.size; ++pass) {
    const surface = new HeadSurface(to, middle);
    const radii = kScalp.map((direction) => surface.radius(direction)).filter((radius) => radius > 0);
    if (radii.length < kMeasuredShareMin * kScalp.length) return fit;
    const ratio = median(radii) / groomRadius;
    const start: Numbers = [pass > 0 ? fit.size : ratio, middle.y, middle.z];
    start[1] -= start[0] * groomMiddle.y;
    start[2] -= start[0] * groomMiddle.z;
    const [size, y, z] = settle(skull, surface, start, kOutlierShare * median(radii));
    // A size beyond the limits is cut, and the offsets change so that the middle of the skull stays where it was found.
    const kept = Math.min(Math.max(size, ratio / kSizeChange), ratio * kSizeChange);
    fit = { size: kept, offset: [0, y + (size - kept) * groomMiddle.y, z + (size - kept) * groomMiddle.z] };
    const before: Vector3 = middle;
    middle = groomMiddle
      .clone()
      .multiplyScalar(fit.size)
      .add(new Vector3(...fit.offset));
    change = before.distanceTo(middle);
  }
  return fit;
}

/** What is fitted: the size, the offset along y, and the offset along z. Heads are symmetric, so x stays. */
type Numbers = [number, number, number];

/**
 * Finds the size and offsets by Gauss-Newton steps on the weighted distances of the moved skull from the surface.
 * `outlierM`: the distance beyond which a point hardly counts.
 */
function settle(skull: readonly Vector3[], surface: HeadSurface, start: Numbers, outlierM: number): Numbers {
  const at: Numbers = [...start];
  const distance = (point: Vector3, [size, y, z]: Numbers): number | null => {
    moved
      .copy(point)
      .multiplyScalar(size)
      .add(shift.set(0, y, z))
      .sub(surface.middle);
    const radius = surface.radius(moved);
    return radius > 0 ? moved.length() - radius : null;
  };
  for (let step = 0; step < 40; ++step) {
    const normal = new Matrix3().set(0, 0, 0, 0, 0, 0, 0, 0, 0);
    const right = new Vector3();
    for (const point of skull) {
      const d = distance(point, at);
      if (d === null) continue;
      const slope = at.map((x, n) => {
        // The derivative by each number is a difference over a step of 1e-3 (a share for the size, m for offsets).
        const h = 1e-3;
        const other: Numbers = [...at];
        other[n] = x + h;
        return ((distance(point, other) ?? d) - d) / h;
      });
      // The weight of a sample falls with its distance (Geman-McClure), so ears and horns hardly count.
      const weight = (d < 0 ? kBuriedWeight : 1) / (1 + (d / outlierM) ** 2) ** 2;
      for (let i = 0; i < 3; ++i)
        for (let j = 0; j < 3; ++j) normal.elements[3 * j + i] += weight * slope[i] * slope[j];
      right.add(shift.fromArray(slope).multiplyScalar(weight * d));
    }
    // The equations have no single solution, as where the surface is missing nearly everywhere.
    if (!(Math.abs(normal.determinant()) > 1e-12)) break;
    right.applyMatrix3(normal.invert());
    // One step at most halves the size, so the size stays positive.
    at[0] = Math.max(at[0] - right.x, 0.5 * at[0]);
    at[1] -= right.y;
    at[2] -= right.z;
    if (right.length() < 1e-6) break;
  }
  return at;
}

const moved = new Vector3();
const shift = new Vector3();

function median(values: readonly number[]): number {
  return [...values].sort((a, b) => a - b)[values.length >> 1];
}
