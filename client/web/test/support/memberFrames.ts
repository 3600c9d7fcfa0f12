import type { Frame } from "../../src/hair/frame";
import { LevelIndex } from "../../src/hair/level";
import type { FrameBatch, LinkEvent } from "../../src/net/events";
import { hashGroom } from "../../src/net/groomHash";
import type * as m from "../../src/net/messages";
import { kPlain, type LinkCoreDriver } from "./linkCoreDriver";
import { fromHex, vectors } from "./vectors";

// Member 300 with a groom, the groom's basis, and its frames.
export const sequence = vectors<{
  file: string;
  contents: string[];
  coefficients: number[][];
  /** the hair of an own character after the last frame */
  state: { stepM: number; displacements: number[]; velocities: number[] };
}>("sequence.json");
export const groom = "ab".repeat(32);

const file = fromHex(sequence.file);
const basis = hashGroom(file);

export const joined: m.MemberJoined = {
  type: "memberJoined",
  member: 300,
  session: 5n,
  character: 1,
  groom,
  ...kPlain,
};
export const announced: m.GroomBasis = { type: "groomBasis", groom, basis };
/** The file of the basis, as it is downloaded. */
export const basisData: m.GroomData = {
  type: "groomData",
  hash: basis,
  byteCount: file.length,
  offset: 0,
  bytes: file,
};

/** The frame number n of the sequence. `generation`: it comes in a datagram. */
export function batch(
  n: number,
  more: Partial<m.CodedFrame> = {},
  tick = 100 + n,
  generation: number | null = null,
): m.CodedFrameBatch {
  const frame: m.CodedFrame = {
    member: 300,
    level: LevelIndex.low,
    discontinuous: false,
    asleep: false,
    evaluated: false,
    stepStride: 2,
    content: fromHex(sequence.contents[n]),
    ...more,
  };
  const generations = generation === null ? new Uint8Array() : Uint8Array.of(generation);
  return { type: "frameBatch", tick, sampleTimeNs: tick * 33e6, frames: [frame], generations };
}

/** Gives the client the basis of a groom, of which it has a member: a frame makes it ask. */
export function giveBasis(driver: LinkCoreDriver, of = groom): void {
  driver.tell({ ...announced, groom: of });
  driver.tell(batch(0, {}, 0));
  driver.sent();
  driver.tell(basisData);
  driver.events();
}

export function framesOf(events: LinkEvent[]): Frame[] {
  return events.filter((event): event is FrameBatch => event.type === "frameBatch").flatMap((event) => event.frames);
}
