import { Bone, kNumbersPerBone, rigidPose, type Pose } from "./pose";

// What a network is told of the poses of a character: core/learnt/pose_inputs.hpp, and the same numbers.

/** The time from one pose of a learnt groom to the next. */
export const kLearntTickS = 1 / 30;
export const kPoseInputCount = 24;

const kGravityMPerS2 = 9.81;
// A jump of the head that is too large to simulate.
const kTeleportM = 25 * kLearntTickS;
const kTeleportRad = (2500 * kLearntTickS * Math.PI) / 180;
// Points whose places tell where a body is, head space at rest, m.
const kTrunk = [0, -0.2, 0] as const;
const kLeftShoulder = [0.15, -0.22, 0] as const;
const kRightShoulder = [-0.15, -0.22, 0] as const;

type Vector = readonly [number, number, number];

/** Describes the motion of one character in the axes of its head. */
export class PoseHistory {
  readonly #last: Pose = rigidPose();
  #velocity: Vector = [0, 0, 0];
  /** poses since the last teleport, at most 2 */
  #knownCount = 0;

  /** The next pose counts as still, like the first. */
  forget(): void {
    this.#knownCount = 0;
    this.#velocity = [0, 0, 0];
  }

  /** The next pose, `kLearntTickS` after the last; writes `kPoseInputCount` numbers. */
  next(pose: Pose, out: Float32Array): void {
    const last = this.#last;
    if (this.#knownCount > 0 && isTeleport(last, pose)) this.#knownCount = 0;
    let velocity: Vector = [0, 0, 0];
    let acceleration: Vector = [0, 0, 0];
    let spin: Vector = [0, 0, 0];
    if (this.#knownCount > 0) {
      velocity = [4, 5, 6].map((at) => (pose[at] - last[at]) / kLearntTickS) as unknown as Vector;
      spin = turnOf(last, 0, pose, 0).map((x) => x / kLearntTickS) as unknown as Vector;
    }
    if (this.#knownCount > 1)
      acceleration = velocity.map((v, axis) => (v - this.#velocity[axis]) / kLearntTickS) as unknown as Vector;
    this.#velocity = velocity;
    this.#knownCount = Math.min(this.#knownCount + 1, 2);
    last.set(pose);
    const trunk = kNumbersPerBone * Bone.upperTrunk;
    const up = unrotate(pose, [0, 1, 0]);
    const inputs = [
      [-up[0], 1 - up[1], -up[2]],
      unrotate(pose, velocity),
      unrotate(pose, acceleration).map((a) => a / kGravityMPerS2),
      spin,
      turnOf(pose, 0, pose, trunk),
      shiftDm(pose, trunk, kTrunk),
      shiftDm(pose, kNumbersPerBone * Bone.leftShoulder, kLeftShoulder),
      shiftDm(pose, kNumbersPerBone * Bone.rightShoulder, kRightShoulder),
    ];
    out.set(inputs.flat());
  }
}

/** The rotation from bone `a` of a pose to bone `b` of another: axis times twice the sine of half the angle. */
function turnOf(a: Pose, atA: number, b: Pose, atB: number): Vector {
  const [x, y, z, w] = between(a, atA, b, atB);
  const scale = w < 0 ? -2 : 2;
  return [scale * x, scale * y, scale * z];
}

/** The conjugate of a, times b; x y z w. */
function between(a: Pose, atA: number, b: Pose, atB: number): [number, number, number, number] {
  const [ax, ay, az, aw] = [-a[atA], -a[atA + 1], -a[atA + 2], a[atA + 3]];
  const [bx, by, bz, bw] = [b[atB], b[atB + 1], b[atB + 2], b[atB + 3]];
  return [
    aw * bx + ax * bw + ay * bz - az * by,
    aw * by - ax * bz + ay * bw + az * bx,
    aw * bz + ax * by - ay * bx + az * bw,
    aw * bw - ax * bx - ay * by - az * bz,
  ];
}

function rotate(x: number, y: number, z: number, w: number, v: Vector): Vector {
  const ux = 2 * (y * v[2] - z * v[1]);
  const uy = 2 * (z * v[0] - x * v[2]);
  const uz = 2 * (x * v[1] - y * v[0]);
  return [v[0] + w * ux + (y * uz - z * uy), v[1] + w * uy + (z * ux - x * uz), v[2] + w * uz + (x * uy - y * ux)];
}

/** Into the axes of the head. */
function unrotate(pose: Pose, v: Vector): Vector {
  return rotate(-pose[0], -pose[1], -pose[2], pose[3], v);
}

/** How far a place of a bone is from where the design has it, against the head, dm. */
function shiftDm(pose: Pose, bone: number, place: Vector): Vector {
  const [x, y, z] = rotate(pose[bone], pose[bone + 1], pose[bone + 2], pose[bone + 3], place);
  const point = unrotate(pose, [
    x + pose[bone + 4] - pose[4],
    y + pose[bone + 5] - pose[5],
    z + pose[bone + 6] - pose[6],
  ]);
  return [10 * (point[0] - place[0]), 10 * (point[1] - place[1]), 10 * (point[2] - place[2])];
}

function isTeleport(from: Pose, to: Pose): boolean {
  const distanceM = Math.hypot(to[4] - from[4], to[5] - from[5], to[6] - from[6]);
  const [x, y, z, w] = between(from, 0, to, 0);
  const turnRad = 2 * Math.atan2(Math.hypot(x, y, z), Math.abs(w));
  return distanceM > kTeleportM || turnRad > kTeleportRad;
}
