import type { FrameBatch, LinkEvent } from "../../src/net/events";
import type { Frame } from "../../src/hair/frame";
import { ErrorClass, LevelIndex } from "../../src/hair/level";
import type * as m from "../../src/net/messages";
import { kPlain } from "./linkCoreDriver";
import type { GeometryVector } from "./shapes";
import { geometryOf } from "./shapes";
import { fromHex, vectors } from "./vectors";

// Member 300 with a groom, the record of its level, and its frames.
export const sequence = vectors<{ contents: string[]; orders: number[]; nodes: number[][]; geometry: GeometryVector }>(
  "sequence.json",
);
export const geometry = geometryOf(sequence.geometry);
export const groom = "ab".repeat(32);

export const joined: m.MemberJoined = {
  type: "memberJoined",
  member: 300,
  session: 5n,
  character: 1,
  groom,
  ...kPlain,
};
export const record: m.LevelRecord = { type: "levelRecord", groom, level: LevelIndex.low, geometry };

/** The frame number n of the sequence. */
export function batch(n: number, more: Partial<m.CodedFrame> = {}, tick = 100 + n): m.CodedFrameBatch {
  const frame: m.CodedFrame = {
    member: 300,
    level: LevelIndex.low,
    errorClass: ErrorClass.quarterMm,
    discontinuous: false,
    asleep: false,
    velocities: true,
    coefficients: false,
    order: sequence.orders[n],
    stride: 1,
    stepStride: 2,
    content: fromHex(sequence.contents[n]),
    ...more,
  };
  return { type: "frameBatch", tick, sampleTimeNs: tick * 33e6, frames: [frame] };
}

export function framesOf(events: LinkEvent[]): Frame[] {
  return events.filter((event): event is FrameBatch => event.type === "frameBatch").flatMap((event) => event.frames);
}
