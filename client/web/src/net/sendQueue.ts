import type { ClientMessage, PoseBatch, PoseSample } from "./messages";
import { kPosesPerBatchMax } from "./messages";

// Beside those pushed last.
const kPoseBatchesMax = 64;
const kOthersMax = 65_536;

/**
 * What waits to be sent, in order, but for groom bytes. Bounded: when the connection does not keep up, the oldest pose
 * batches are dropped (newer poses supersede them). No I/O.
 */
export class SendQueue {
  #messages: ClientMessage[] = [];
  #poseBatchCount = 0;
  /** characters whose next pose continues from none that was sent */
  readonly #teleportPending = new Set<number>();
  #posesDropped = 0;

  get posesDropped(): number {
    return this.#posesDropped;
  }

  get isEmpty(): boolean {
    return this.#messages.length === 0;
  }

  /** False when full: more was asked for than any server takes. */
  push(message: ClientMessage): boolean {
    if (this.#messages.length - this.#poseBatchCount >= kOthersMax) return false;
    if (message.type === "poseBatch") ++this.#poseBatchCount;
    this.#messages.push(message);
    return true;
  }

  /**
   * In batches of at most `most` poses. All are queued: where there are too many with them, those pushed before are
   * dropped. A dropped pose's teleport passes to the character's next pose.
   */
  pushPoses(poses: readonly PoseSample[], most = kPosesPerBatchMax): void {
    while (this.#poseBatchCount >= kPoseBatchesMax) this.#dropOldestPoses();
    const fresh = poses.map((pose) =>
      this.#teleportPending.delete(pose.character) ? { ...pose, teleport: true } : pose,
    );
    for (let begin = 0; begin < fresh.length; begin += most) {
      this.#messages.push({ type: "poseBatch", poses: fresh.slice(begin, begin + most) });
      ++this.#poseBatchCount;
    }
  }

  pop(): ClientMessage | null {
    const message = this.#messages.shift();
    if (message?.type === "poseBatch") --this.#poseBatchCount;
    return message ?? null;
  }

  /** All that waits is lost, as the connection is. */
  clear(): void {
    for (const message of this.#messages) {
      if (message.type === "poseBatch") this.dropPoses(message.poses);
    }
    this.#messages = [];
    this.#poseBatchCount = 0;
  }

  /** These poses are not sent at all. */
  dropPoses(poses: readonly PoseSample[]): void {
    this.#posesDropped += poses.length;
    for (const pose of poses) {
      if (pose.teleport) this.#teleportPending.add(pose.character);
    }
  }

  #dropOldestPoses(): void {
    const oldest = this.#messages.findIndex((message) => message.type === "poseBatch");
    const dropped = this.#messages.splice(oldest, 1)[0] as PoseBatch;
    --this.#poseBatchCount;
    this.#posesDropped += dropped.poses.length;
    for (const pose of dropped.poses) {
      if (pose.teleport) this.#carryTeleport(oldest, pose.character);
    }
  }

  /** The character's next pose from message `from` on no longer continues from what the server saw last. */
  #carryTeleport(from: number, character: number): void {
    for (let i = from; i < this.#messages.length; ++i) {
      const message = this.#messages[i];
      if (message.type !== "poseBatch") continue;
      const next = message.poses.findIndex((pose) => pose.character === character);
      if (next < 0) continue;
      const poses = message.poses.map((pose, p) => (p === next ? { ...pose, teleport: true } : pose));
      this.#messages[i] = { type: "poseBatch", poses };
      return;
    }
    this.#teleportPending.add(character);
  }
}
