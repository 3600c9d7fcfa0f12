import { Box3, Matrix4, type PerspectiveCamera, Quaternion, Vector3 } from "three";
import { checkOptions } from "../hair/checkOptions";
import type { Groom } from "../hair/groom";
import { HairnetError } from "../module/hairnetError";
import { Bone, kNumbersPerBone, type Pose } from "../hair/pose";

export interface FrameOptions {
  /** The size of the view over the size of what it must show. The default 1.15 leaves room for hair that moves. */
  readonly margin?: number;
  /** The number of the member to show; by default all members are shown. */
  readonly member?: number;
}
/** The names of all options, for `checkOptions`. */
const kOptions: Readonly<Record<keyof FrameOptions, true>> = { margin: true, member: true };
/** The default of `FrameOptions.margin`. */
const kMargin = 1.15;

/** What a picture must show of a groom. */
type Shape = Pick<Groom, "points" | "body">;

/** A character as a camera frames it. */
export interface Framed {
  /** The bones, scene space. */
  readonly pose: Pose;
  /** The scale of the character; negative: mirrored. */
  readonly size: number;
  /** Null: the groom has not arrived yet, and a head with long hair is assumed. */
  readonly groom: Shape | null;
}

/** Throws `HairnetError` unless `HairScene.frame` can do that. */
export function checkFrame(camera: PerspectiveCamera, options: FrameOptions): void {
  checkOptions(options, kOptions, "frame");
  if (camera?.isPerspectiveCamera !== true) throw new HairnetError("invalid", "frame: give a PerspectiveCamera");
  const { margin = kMargin, member } = options;
  if (!(margin > 0 && margin < Infinity)) throw new HairnetError("invalid", "frame: the margin is not above 0");
  if (member !== undefined && !Number.isInteger(member))
    throw new HairnetError("invalid", "frame: a member is named by its number, as in room.members");
}

/**
 * Puts the camera in front of these characters, at the height of their middle, so near that their heads, hair and busts
 * just fit into the picture. Returns the point that it looks at, in scene space. Null, and the camera stays: it has no
 * finite field of view or aspect, such as that of a canvas without a size.
 */
export function frameCamera(
  camera: PerspectiveCamera,
  characters: readonly Framed[],
  margin = kMargin,
): Vector3 | null {
  const facing = facingOf(characters);
  const right = new Vector3(0, 1, 0).cross(facing);
  const corners = characters.flatMap(cornersOf);
  const tangent = Math.tan((camera.fov * Math.PI) / 360) / margin;
  const depth = (corner: Vector3) => corner.dot(facing);
  const across = enclose(corners, (corner) => corner.dot(right), depth, tangent * camera.aspect);
  const up = enclose(corners, (corner) => corner.y, depth, tangent);
  const eye = facing.clone().multiplyScalar(Math.max(across.eye, up.eye)).addScaledVector(right, across.middle);
  eye.y = up.middle;
  if (!Number.isFinite(eye.x + eye.y + eye.z)) return null;
  const depths = corners.map(depth);
  const centre = eye.clone().addScaledVector(facing, (Math.min(...depths) + Math.max(...depths)) / 2 - depth(eye));
  const toWorld = new Matrix4().lookAt(eye, centre, new Vector3(0, 1, 0)).setPosition(eye);
  camera.parent?.updateWorldMatrix(true, false);
  const toParent = camera.parent ? new Matrix4().copy(camera.parent.matrixWorld).invert() : new Matrix4();
  toParent.multiply(toWorld).decompose(camera.position, camera.quaternion, new Vector3());
  camera.updateWorldMatrix(false, true);
  return centre;
}

// Finds where the eye must be along one axis of the picture (`middle`) and in depth (`eye`). `at` and `depth` are a
// corner's coordinates along that axis and towards the eye; `tangent` is that of the half angle of view. A corner is in
// view if |at - middle| <= tangent * (eye - depth). So the corner with the largest tangent * depth + at limits one
// side, and the one with the largest tangent * depth - at the other: the nearest eye meets both limits with equality.
function enclose(
  corners: readonly Vector3[],
  at: (corner: Vector3) => number,
  depth: (corner: Vector3) => number,
  tangent: number,
): { eye: number; middle: number } {
  const most = Math.max(...corners.map((corner) => tangent * depth(corner) + at(corner)));
  const least = Math.max(...corners.map((corner) => tangent * depth(corner) - at(corner)));
  return { eye: (most + least) / (2 * tangent), middle: (most - least) / 2 };
}

// The horizontal direction into which the trunks face in the mean. Heads turn more than trunks.
function facingOf(characters: readonly Framed[]): Vector3 {
  const facing = new Vector3();
  const at = Bone.upperTrunk * kNumbersPerBone;
  for (const { pose, size } of characters)
    facing.add(
      new Vector3(0, 0, Math.sign(size)).applyQuaternion(
        new Quaternion(pose[at], pose[at + 1], pose[at + 2], pose[at + 3]),
      ),
    );
  facing.y = 0;
  // Trunks that face each other have no mean direction; then the camera looks from +Z.
  return facing.length() < 1e-3 ? facing.set(0, 0, 1) : facing.normalize();
}

// The corners of the character's box, at its head.
function cornersOf({ pose, size, groom }: Framed): Vector3[] {
  const { min, max } = groom ? boxOf(groom) : kUnknownBox;
  const turn = new Quaternion(pose[0], pose[1], pose[2], pose[3]);
  const corners: Vector3[] = [];
  for (const x of [min.x, max.x])
    for (const y of [min.y, max.y])
      for (const z of [min.z, max.z])
        corners.push(
          new Vector3(x, y, z)
            .multiplyScalar(size)
            .applyQuaternion(turn)
            .add(new Vector3(pose[4], pose[5], pose[6])),
        );
  return corners;
}

// The box of a head with long hair, head space, m.
const kUnknownBox = new Box3(new Vector3(-0.2, -0.35, -0.2), new Vector3(0.2, 0.25, 0.2));
/** The boxes that `boxOf` has measured. A groom never changes. */
const boxes = new WeakMap<Shape, Box3>();

// The box of all points of the groom's hair and body, head space, m.
function boxOf(groom: Shape): Box3 {
  const known = boxes.get(groom);
  if (known) return known;
  const box = new Box3().setFromArray(groom.points);
  box.union(new Box3().setFromArray(groom.body.vertices));
  boxes.set(groom, box);
  return box;
}
