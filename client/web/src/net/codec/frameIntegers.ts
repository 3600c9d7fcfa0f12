import { kBoneCount } from "../../hair/pose";

/** Position x y z and quaternion x y z w of each bone. */
export const kIntegersPerBone = 7;
export const kBoneIntegers = kIntegersPerBone * kBoneCount;
/** Earlier frames that a frame may be predicted from. */
export const kHistoryMax = 3;

/** What a frame's content says. Its arrays are reused: they have room for more than counts. */
export class FrameIntegers {
  /** position x y z in 2^-14 m and quaternion x y z w in 2^-15, of each bone */
  readonly bones = new Int32Array(kBoneIntegers);
  /** 3 an active node, in steps of the error class; empty: rigid */
  nodes: Int16Array = new Int16Array(0);
  /** as `nodes`, in units of 32 steps a second; empty: not sent */
  velocities: Int16Array = new Int16Array(0);
  #nodeRoom = new Int16Array(0);
  #velocityRoom = new Int16Array(0);

  /** Sets how many numbers there are; what they are is left open. Allocates only what it never had. */
  resize(nodeNumbers: number, velocityNumbers: number): void {
    if (this.nodes.length !== nodeNumbers) {
      if (this.#nodeRoom.length < nodeNumbers) this.#nodeRoom = new Int16Array(nodeNumbers);
      this.nodes = this.#nodeRoom.subarray(0, nodeNumbers);
    }
    if (this.velocities.length !== velocityNumbers) {
      if (this.#velocityRoom.length < velocityNumbers) this.#velocityRoom = new Int16Array(velocityNumbers);
      this.velocities = this.#velocityRoom.subarray(0, velocityNumbers);
    }
  }
}

/** Earlier frames of the same character, level and class, the newest first. */
export type History = readonly FrameIntegers[];
