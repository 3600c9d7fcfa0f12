// What the native programs write: a trace of frames (client/files/README.md), and the lattice that its rows belong to.
import { execFile } from "node:child_process";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { promisify } from "node:util";
import { nodeCount, type Lattice } from "../src/hair/movedLattice";
import { kBoneCount, kNumbersPerBone, kPoseNumbers } from "../src/hair/pose";
import { program } from "./hairnetServer";

/** One frame as a native client received it. */
export interface TracedFrame {
  readonly tick: number;
  readonly character: bigint;
  readonly isDiscontinuous: boolean;
  /** As `Pose`. */
  readonly pose: readonly number[];
  /** The displacements of the active nodes, 3 numbers each, head space, m; empty: the hair is at rest. */
  readonly displacements: Float32Array;
}

/** The lattice of a hairstyle's finest level, as `hairnet-sim --dump-model` writes it (client/tools/sim/README.md). */
export interface LatticeModel {
  readonly lattice: Lattice;
  readonly nodes: { readonly active: readonly number[] };
  readonly trimmed: readonly {
    readonly node: number;
    readonly from: readonly number[];
    readonly weights: readonly number[];
  }[];
}

/** Reads the frames of a trace in their order. */
export function readTrace(folder: string): TracedFrame[] {
  const frames = new BigInt64Array(numbersOf(join(folder, "frames.npy")));
  const poses = new Float32Array(numbersOf(join(folder, "poses.npy")));
  const displacements = new Float32Array(numbersOf(join(folder, "displacements.npy")));
  // A row of frames.npy: tick, character, level, discontinuous, first, count, asleep, step stride.
  return Array.from({ length: frames.length / 8 }, (_, n) => {
    const [tick, character, , discontinuous, first, count] = frames.subarray(8 * n, 8 * n + 6);
    return {
      tick: Number(tick),
      character,
      isDiscontinuous: discontinuous !== 0n,
      pose: poseOf(poses.subarray(kPoseNumbers * n, kPoseNumbers * (n + 1))),
      displacements: displacements.subarray(3 * Number(first), 3 * Number(first + count)),
    };
  });
}

/** Builds the lattice of a groom file. */
export async function latticeModel(groom: string, folder: string): Promise<LatticeModel> {
  const file = join(folder, "model.json");
  await promisify(execFile)(program("hairnet-sim"), ["--groom", groom, "--level", "high", "--dump-model", file]);
  return JSON.parse(readFileSync(file, "utf8")) as LatticeModel;
}

/** The displacements of all nodes of the lattice, from those of the active ones. */
export function allNodes({ lattice, nodes, trimmed }: LatticeModel, displacements: Float32Array): number[] {
  if (displacements.length !== 3 * nodes.active.length)
    throw new Error(`${displacements.length / 3} nodes are displaced, and ${nodes.active.length} are active`);
  const all = new Array<number>(3 * nodeCount(lattice)).fill(0);
  for (const [i, node] of nodes.active.entries())
    for (let axis = 0; axis < 3; ++axis) all[3 * node + axis] = displacements[3 * i + axis];
  for (const { node, from, weights } of trimmed)
    for (const [e, other] of from.entries())
      for (let axis = 0; axis < 3; ++axis) all[3 * node + axis] += weights[e] * all[3 * other + axis];
  return all;
}

/** A trace has each bone's position before its rotation, and a `Pose` has the rotation first. */
function poseOf(row: Float32Array): number[] {
  return Array.from({ length: kBoneCount }, (_, bone) => {
    const own = row.subarray(kNumbersPerBone * bone, kNumbersPerBone * (bone + 1));
    return [...own.subarray(3), ...own.subarray(0, 3)];
  }).flat();
}

/** The numbers of a .npy file: its header begins after 10 bytes, the last two of which are the header's length. */
function numbersOf(path: string): ArrayBuffer {
  const file = readFileSync(path);
  return new Uint8Array(file.subarray(10 + file.readUInt16LE(8))).buffer;
}
