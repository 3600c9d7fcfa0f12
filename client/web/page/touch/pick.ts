import { Quaternion, Ray, Vector3 } from "three";
import { kBoneCount, kNumbersPerBone, type Body, type Member, type Pose } from "../../src/index";

/** Somebody whose hair may be picked. */
export type Pickable = Pick<Member, "pose" | "points"> & { readonly groom: { readonly body: Body } | null };

/** A place in somebody's hair. */
export interface Picked<One = Member> {
  readonly member: One;
  /** The place, world, m. */
  readonly place: Vector3;
}

/** Members whose head joint is further from the ray or place than this are not searched, m. */
const kHairReachM = 0.8;
/** Hair that is less than this inside the body can be picked, m: the triangles of bodies are coarse. */
const kBodySlackM = 0.012;
/** An eye nearer than this to a head joint looks out of that head, whose inside hides nothing, m. */
const kWithinHeadM = 0.2;

/**
 * The place in hair that a ray meets first: of all points of hair within the angle `withinRad` of the ray, as seen from
 * its origin, the one nearest to the origin. Null where there is no such point, or a body hides it.
 */
export function pickHair<One extends Pickable>(
  ray: Ray,
  withinRad: number,
  members: Iterable<One>,
): Picked<One> | null {
  // A point is within the angle if its squared distance from the ray is at most slope2 times its squared depth.
  const slope2 = Math.tan(withinRad) ** 2;
  const { origin, direction } = ray;
  let depth = Infinity;
  let picked: Picked<One> | null = null;
  const near = [...members].filter(({ pose }) => pose && ray.distanceToPoint(headOf(pose)) <= kHairReachM);
  // `depth` carries over from one member to the next, so only hair nearer than all before it replaces the result.
  for (const one of near) {
    const points = one.points();
    if (!points) continue;
    let found = -1;
    for (let i = 0; i < points.length; i += 3) {
      const [x, y, z] = [points[i] - origin.x, points[i + 1] - origin.y, points[i + 2] - origin.z];
      const along = x * direction.x + y * direction.y + z * direction.z;
      if (along <= 0 || along >= depth) continue;
      if (x * x + y * y + z * z - along * along > slope2 * along * along) continue;
      depth = along;
      found = i;
    }
    if (found >= 0) picked = { member: one, place: new Vector3().fromArray(points, found) };
  }
  // A body hides the picked hair when its surface is nearer to the origin by more than kBodySlackM.
  const hides = ({ pose, groom }: One) =>
    pose !== null &&
    groom !== null &&
    headOf(pose).distanceTo(origin) > kWithinHeadM &&
    depthOfBody(ray, groom.body, pose) + kBodySlackM < depth;
  return picked && !near.some(hides) ? picked : null;
}

/** Whose hair has the point nearest to a place (world), at most `withinM` away; null: nobody's. */
export function nearestHair<One extends Pickable>(place: Vector3, withinM: number, members: Iterable<One>): One | null {
  let nearest2 = withinM * withinM;
  let nearest: One | null = null;
  for (const one of members) {
    if (!one.pose || headOf(one.pose).distanceTo(place) > kHairReachM) continue;
    const points = one.points() ?? [];
    for (let i = 0; i < points.length; i += 3) {
      const apart2 = (points[i] - place.x) ** 2 + (points[i + 1] - place.y) ** 2 + (points[i + 2] - place.z) ** 2;
      if (apart2 > nearest2) continue;
      nearest2 = apart2;
      nearest = one;
    }
  }
  return nearest;
}

/**
 * How far along a ray the body begins, m; infinite if the ray misses it. Each triangle moves with the heaviest bone of
 * its first corner, so the ray is moved into the rest space of each bone instead of all triangles.
 */
function depthOfBody(ray: Ray, { vertices, boneWeights, triangles }: Body, pose: Pose): number {
  const rays = Array.from({ length: kBoneCount }, (_, bone) => atRest(ray, pose, bone));
  const corners = [new Vector3(), new Vector3(), new Vector3()] as const;
  const hit = new Vector3();
  let depth = Infinity;
  for (let t = 0; t < triangles.length; t += 3) {
    for (const [n, corner] of corners.entries()) corner.fromArray(vertices, 3 * triangles[t + n]);
    const own = rays[mainBone(boneWeights, triangles[t])];
    if (own.intersectTriangle(...corners, false, hit)) depth = Math.min(depth, own.origin.distanceTo(hit));
  }
  return depth;
}

/** The ray in head space at rest, as a bone sees it. */
function atRest({ origin, direction }: Ray, pose: Pose, bone: number): Ray {
  const at = bone * kNumbersPerBone;
  const back = new Quaternion().fromArray(pose, at).invert();
  const from = origin.clone().sub(new Vector3().fromArray(pose, at + 4));
  return new Ray(from.applyQuaternion(back), direction.clone().applyQuaternion(back));
}

/** The bone with the largest weight at a vertex. */
function mainBone(weights: Float32Array, vertex: number): number {
  let main = 0;
  for (let bone = 1; bone < kBoneCount; ++bone)
    if (weights[kBoneCount * vertex + bone] > weights[kBoneCount * vertex + main]) main = bone;
  return main;
}

function headOf(pose: Pose): Vector3 {
  return new Vector3().fromArray(pose, 4);
}
