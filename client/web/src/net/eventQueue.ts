import type { Frame } from "../hair/frame";
import type { Disconnected, FrameBatch, LinkEvent } from "./events";

const kFrameBytesMax = 32 << 20;
const kOtherBytesMax = 256 << 20;
/** Of what an object takes besides its arrays. */
const kObjectBytes = 512;

/**
 * Events that the caller has not taken yet, in order. The queue is bounded: it drops the oldest frames first. A caller that
 * takes nothing at all is disconnected. No I/O.
 */
export class EventQueue {
  #events: LinkEvent[] = [];
  #frameBytes = 0;
  #otherBytes = 0;
  /** members whose next frame does not continue the last taken one */
  readonly #discontinuityPending = new Set<number>();
  #framesDropped = 0;
  #ended = false;

  get framesDropped(): number {
    return this.#framesDropped;
  }

  /** False when full of what may not be dropped. */
  push(event: LinkEvent): boolean {
    if (this.#ended) return true;
    if (event.type === "frameBatch") {
      const batch = this.#discontinuityPending.size > 0 ? this.#withDiscontinuities(event) : event;
      this.#frameBytes += bytesOfBatch(batch);
      this.#events.push(batch);
      while (this.#frameBytes > kFrameBytesMax) this.#dropOldestFrames();
      return true;
    }
    if (event.type === "memberLeft") this.#discontinuityPending.delete(event.member);
    const bytes = bytesOf(event);
    if (this.#otherBytes + bytes > kOtherBytesMax) return false;
    this.#otherBytes += bytes;
    this.#events.push(event);
    return true;
  }

  pushLast(event: Disconnected): void {
    if (this.#ended) return;
    this.#ended = true;
    this.#events.push(event);
  }

  takeAll(): LinkEvent[] {
    const taken = this.#events;
    this.#events = [];
    this.#frameBytes = this.#otherBytes = 0;
    return taken;
  }

  #dropOldestFrames(): void {
    const oldest = this.#events.findIndex((event) => event.type === "frameBatch");
    const dropped = this.#events.splice(oldest, 1)[0] as FrameBatch;
    this.#frameBytes -= bytesOfBatch(dropped);
    this.#framesDropped += dropped.frames.length;
    for (const frame of dropped.frames) {
      if (frame.discontinuous) this.#carryDiscontinuity(frame.member, oldest);
    }
  }

  /** Marks the member's next queued frame as discontinuous, so that the caller does not interpolate across the gap. */
  #carryDiscontinuity(member: number, from: number): void {
    for (let i = from; i < this.#events.length; ++i) {
      const event = this.#events[i];
      if (event.type !== "frameBatch") continue;
      const next = event.frames.findIndex((frame) => frame.member === member);
      if (next < 0) continue;
      const frames: Frame[] = event.frames.slice();
      frames[next] = { ...frames[next], discontinuous: true };
      this.#events[i] = { ...event, frames };
      return;
    }
    this.#discontinuityPending.add(member);
  }

  #withDiscontinuities(batch: FrameBatch): FrameBatch {
    const frames = batch.frames.map((frame) =>
      this.#discontinuityPending.delete(frame.member) ? { ...frame, discontinuous: true } : frame,
    );
    return { ...batch, frames };
  }
}

function bytesOfBatch(batch: FrameBatch): number {
  let bytes = kObjectBytes;
  for (const frame of batch.frames) bytes += kObjectBytes + frame.coefficients.byteLength;
  return bytes;
}

function bytesOf(event: LinkEvent): number {
  if (event.type === "groomFetched") return kObjectBytes + (event.bytes?.length ?? 0);
  return 4 * kObjectBytes;
}
