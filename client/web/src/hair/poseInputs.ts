import { Bone, kNumbersPerBone, rigidPose, type Pose } from "./pose";

// What a network is told of the poses of a character: core/learnt/pose_inputs.hpp, and the same numbers.

/** The time from one pose of a learnt groom to the next. */
export const kLearntTickS = 1 / 30;
export const kPoseInputCount = 24;

const kGravityMPerS2 = 9.81;
// A jump of the head that is too large to simulate (core/pose/pose.hpp).
const kTeleportMPerS = 25;
const kTeleportChange = 0.25;
const kRideMPerSMax = 1000;
const kTeleportRad = (2500 * kLearntTickS * Math.PI) / 180;
// Points whose places tell where a body is, head space at rest, m.
const kTrunk = [0, -0.2, 0] as const;
const kLeftShoulder = [0.15, -0.22, 0] as const;
const kRightShoulder = [-0.15, -0.22, 0] as const;

/** Describes the motion of one character in the axes of its head. */
export class PoseHistory {
  readonly #last: Pose = rigidPose();
  /** x y z, in the world, m/s */
  readonly #velocity = new Float64Array(3);
  /** that of the pose before, also after a jump; x y z, in the world, m/s */
  readonly #expected = new Float64Array(3);
  /** poses since the last teleport, at most 2 */
  #knownCount = 0;

  /** The next pose counts as still, like the first. */
  forget(): void {
    this.#knownCount = 0;
    this.#velocity.fill(0);
  }

  /** The next pose, `kLearntTickS` after the last; writes `kPoseInputCount` numbers. */
  next(pose: Pose, out: Float64Array): void {
    const last = this.#last;
    const velocity = this.#velocity;
    if (this.#knownCount > 0 && isTeleport(last, pose, this.#expected)) this.#knownCount = 0;
    const [vx, vy, vz] = velocity;
    for (let axis = 0; axis < 3; ++axis)
      velocity[axis] = this.#knownCount > 0 ? (pose[4 + axis] - last[4 + axis]) / kLearntTickS : 0;
    out.fill(0, 0, kPoseInputCount);
    unrotate(pose, 0, 1, 0, -1, out, 0);
    out[1] += 1;
    unrotate(pose, velocity[0], velocity[1], velocity[2], 1, out, 3);
    if (this.#knownCount > 1) {
      const scale = 1 / (kLearntTickS * kGravityMPerS2);
      unrotate(pose, velocity[0] - vx, velocity[1] - vy, velocity[2] - vz, scale, out, 6);
    }
    if (this.#knownCount > 0) writeTurn(last, 0, pose, 0, 1 / kLearntTickS, out, 9);
    writeTurn(pose, 0, pose, kNumbersPerBone * Bone.upperTrunk, 1, out, 12);
    writeShiftDm(pose, kNumbersPerBone * Bone.upperTrunk, kTrunk, out, 15);
    writeShiftDm(pose, kNumbersPerBone * Bone.leftShoulder, kLeftShoulder, out, 18);
    writeShiftDm(pose, kNumbersPerBone * Bone.rightShoulder, kRightShoulder, out, 21);
    this.#knownCount = Math.min(this.#knownCount + 1, 2);
    last.set(pose);
  }
}

// Everything is written in place: a crowd has thousands of these a second.

/** `scale` times the rotation from bone `a` of a pose to bone `b` of another: axis times twice the sine of half the angle. */
function writeTurn(a: Pose, atA: number, b: Pose, atB: number, scale: number, out: Float64Array, at: number): void {
  writeBetween(a, atA, b, atB);
  const factor = turn[3] < 0 ? -2 * scale : 2 * scale;
  for (let axis = 0; axis < 3; ++axis) out[at + axis] = factor * turn[axis];
}

const turn = new Float64Array(4);

/** The conjugate of a, times b; x y z w. */
function writeBetween(a: Pose, atA: number, b: Pose, atB: number): void {
  const ax = -a[atA];
  const ay = -a[atA + 1];
  const az = -a[atA + 2];
  const aw = a[atA + 3];
  const bx = b[atB];
  const by = b[atB + 1];
  const bz = b[atB + 2];
  const bw = b[atB + 3];
  turn[0] = aw * bx + ax * bw + ay * bz - az * by;
  turn[1] = aw * by - ax * bz + ay * bw + az * bx;
  turn[2] = aw * bz + ax * by - ay * bx + az * bw;
  turn[3] = aw * bw - ax * bx - ay * by - az * bz;
}

/** `scale` times the vector, turned by the bone at `bone`; `sign` -1: turned back. */
function writeTurned(
  pose: Pose,
  bone: number,
  sign: number,
  vx: number,
  vy: number,
  vz: number,
  scale: number,
  out: Float64Array,
  at: number,
): void {
  const x = sign * pose[bone];
  const y = sign * pose[bone + 1];
  const z = sign * pose[bone + 2];
  const w = pose[bone + 3];
  const ux = 2 * (y * vz - z * vy);
  const uy = 2 * (z * vx - x * vz);
  const uz = 2 * (x * vy - y * vx);
  out[at] = scale * (vx + w * ux + (y * uz - z * uy));
  out[at + 1] = scale * (vy + w * uy + (z * ux - x * uz));
  out[at + 2] = scale * (vz + w * uz + (x * uy - y * ux));
}

/** `scale` times the vector, in the axes of the head. */
function unrotate(pose: Pose, x: number, y: number, z: number, scale: number, out: Float64Array, at: number): void {
  writeTurned(pose, 0, -1, x, y, z, scale, out, at);
}

/** How far a place of a bone is from where the design has it, against the head, dm. */
function writeShiftDm(
  pose: Pose,
  bone: number,
  place: readonly [number, number, number],
  out: Float64Array,
  at: number,
): void {
  writeTurned(pose, bone, 1, place[0], place[1], place[2], 1, out, at);
  const x = out[at] + pose[bone + 4] - pose[4];
  const y = out[at + 1] + pose[bone + 5] - pose[5];
  const z = out[at + 2] + pose[bone + 6] - pose[6];
  unrotate(pose, x, y, z, 10, out, at);
  for (let axis = 0; axis < 3; ++axis) out[at + axis] -= 10 * place[axis];
}

/** Whether the head jumps from one pose to the next; then `expected` is the velocity to compare the one after with. */
function isTeleport(from: Pose, to: Pose, expected: Float64Array): boolean {
  const x = (to[4] - from[4]) / kLearntTickS;
  const y = (to[5] - from[5]) / kLearntTickS;
  const z = (to[6] - from[6]) / kLearntTickS;
  const speed = Math.sqrt(x * x + y * y + z * z);
  const dx = x - expected[0];
  const dy = y - expected[1];
  const dz = z - expected[2];
  const before = Math.sqrt(expected[0] * expected[0] + expected[1] * expected[1] + expected[2] * expected[2]);
  const changes = Math.sqrt(dx * dx + dy * dy + dz * dz) > kTeleportMPerS + kTeleportChange * before;
  if (speed > kRideMPerSMax) return true;
  expected[0] = x;
  expected[1] = y;
  expected[2] = z;
  if (speed > kTeleportMPerS && changes) return true;
  writeBetween(from, 0, to, 0);
  const sine = Math.sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]);
  return 2 * Math.atan2(sine, Math.abs(turn[3])) > kTeleportRad;
}
