import type { LevelGeometry } from "./lattice";
import { nodePosition } from "./lattice";
import type { Pose } from "./pose";

/** A lattice at one moment: displacement, and each node's velocity in the world, in head axes. */
export interface MovingLattice {
  readonly displacement: Float32Array;
  readonly velocity: Float32Array;
}

/**
 * A cubic through two lattices with their velocities. Let x = p^0 + d be the node in the head's axes, w the head's
 * angular velocity in these axes, and t the head's position. Then
 *
 *   p' = t' + R (w x x + d').
 *
 * Both w and t' are constant while `interpolatePose` moves the head, so d' follows from the node's velocity R^-1 p' in
 * the frame. That velocity is the mean over the step that ended with the frame; half a step's change gives the velocity
 * at the frame's moment.
 */
export class HermiteLattice {
  #durationS = 1;
  #halfStep = 0;
  /** from the axes of the later head into those of the earlier, row by row; its inverse is its transpose */
  readonly #turned = new Float64Array(9);
  readonly #spin = new Float64Array(3);
  readonly #driftFrom = new Float64Array(3);
  readonly #driftTo = new Float64Array(3);
  readonly #rest = new Float64Array(3);

  /** Sets the head's motion between two poses at that distance in time, for steps of `stepS`. */
  set(from: Pose, to: Pose, durationS: number, stepS: number): void {
    this.#durationS = durationS;
    this.#halfStep = stepS / durationS / 2;
    const turn = nearerProduct(from, to);
    const [x, y, z, w] = turn;
    const sine = Math.hypot(x, y, z);
    const angle = 2 * Math.atan2(sine, w);
    const spin = sine > 0 ? angle / sine / durationS : 0;
    this.#spin.set([x * spin, y * spin, z * spin]);
    const drift: [number, number, number] = [
      (to[4] - from[4]) / durationS,
      (to[5] - from[5]) / durationS,
      (to[6] - from[6]) / durationS,
    ];
    turnBack(from, drift, this.#driftFrom);
    turnBack(to, drift, this.#driftTo);
    // biome-ignore format: a matrix is three rows of three.
    this.#turned.set([
      1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
      2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
      2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
    ]);
  }

  /** Computes the displacements at s in [0, 1] of the interval. */
  interpolate(from: MovingLattice, to: MovingLattice, geometry: LevelGeometry, s: number, out: Float32Array): void {
    const s2 = s * s;
    const s3 = s2 * s;
    const atFrom = 2 * s3 - 3 * s2 + 1;
    const atTo = 3 * s2 - 2 * s3;
    const slopeFrom = (s3 - 2 * s2 + s) * this.#durationS;
    const slopeTo = (s3 - s2) * this.#durationS;
    const half = this.#halfStep;
    const m = this.#turned;
    const [wx, wy, wz] = this.#spin;
    const driftFrom = this.#driftFrom;
    const driftTo = this.#driftTo;
    const rest = this.#rest;
    for (let n = 0; n < geometry.activeNodes.length; ++n) {
      nodePosition(geometry.lattice, geometry.activeNodes[n], rest);
      const at = 3 * n;
      const ax = from.displacement[at];
      const ay = from.displacement[at + 1];
      const az = from.displacement[at + 2];
      const bx = to.displacement[at];
      const by = to.displacement[at + 1];
      const bz = to.displacement[at + 2];
      const vx = from.velocity[at];
      const vy = from.velocity[at + 1];
      const vz = from.velocity[at + 2];
      const ux = to.velocity[at];
      const uy = to.velocity[at + 1];
      const uz = to.velocity[at + 2];
      // spin x (rest + displacement)
      const px = rest[0] + ax;
      const py = rest[1] + ay;
      const pz = rest[2] + az;
      const qx = rest[0] + bx;
      const qy = rest[1] + by;
      const qz = rest[2] + bz;
      const fromX = vx + half * (m[0] * ux + m[1] * uy + m[2] * uz - vx) - driftFrom[0] - (wy * pz - wz * py);
      const fromY = vy + half * (m[3] * ux + m[4] * uy + m[5] * uz - vy) - driftFrom[1] - (wz * px - wx * pz);
      const fromZ = vz + half * (m[6] * ux + m[7] * uy + m[8] * uz - vz) - driftFrom[2] - (wx * py - wy * px);
      const toX = ux + half * (ux - (m[0] * vx + m[3] * vy + m[6] * vz)) - driftTo[0] - (wy * qz - wz * qy);
      const toY = uy + half * (uy - (m[1] * vx + m[4] * vy + m[7] * vz)) - driftTo[1] - (wz * qx - wx * qz);
      const toZ = uz + half * (uz - (m[2] * vx + m[5] * vy + m[8] * vz)) - driftTo[2] - (wx * qy - wy * qx);
      out[at] = atFrom * ax + atTo * bx + slopeFrom * fromX + slopeTo * toX;
      out[at + 1] = atFrom * ay + atTo * by + slopeFrom * fromY + slopeTo * toY;
      out[at + 2] = atFrom * az + atTo * bz + slopeFrom * fromZ + slopeTo * toZ;
    }
  }
}

/** conj(a) * b of the heads' rotations, x y z w, with the sign of less than half a turn. */
function nearerProduct(a: Pose, b: Pose): [number, number, number, number] {
  const ax = -a[0];
  const ay = -a[1];
  const az = -a[2];
  const aw = a[3];
  const [bx, by, bz, bw] = b;
  const w = aw * bw - ax * bx - ay * by - az * bz;
  const side = w < 0 ? -1 : 1;
  return [
    side * (aw * bx + ax * bw + ay * bz - az * by),
    side * (aw * by - ax * bz + ay * bw + az * bx),
    side * (aw * bz + ax * by - ay * bx + az * bw),
    side * w,
  ];
}

/** Rotates a world vector into the axes of the pose's head. */
function turnBack(pose: Pose, [vx, vy, vz]: readonly [number, number, number], out: Float64Array): void {
  const x = -pose[0];
  const y = -pose[1];
  const z = -pose[2];
  const w = pose[3];
  // v + 2 q x (q x v + w v)
  const cx = y * vz - z * vy + w * vx;
  const cy = z * vx - x * vz + w * vy;
  const cz = x * vy - y * vx + w * vz;
  out[0] = vx + 2 * (y * cz - z * cy);
  out[1] = vy + 2 * (z * cx - x * cz);
  out[2] = vz + 2 * (x * cy - y * cx);
}
