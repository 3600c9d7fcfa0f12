import * as flatbuffers from "flatbuffers";
import { makeLearntHair, type LearntHair } from "../hair/learntHair";
import { layouts } from "./generated/layout";
import * as fb from "./generated/messages";
import { kPackedLearnt, unpack } from "./packing";
import { verifyBuffer } from "./verify";

/**
 * The learnt hair of a file, checked all through. Nothing of it lies in `file`. Throws `HairnetError` and nothing else.
 */
export function decodeLearnt(file: Uint8Array): LearntHair {
  const table = unpack(file, kPackedLearnt);
  verifyBuffer(table, "HNLH", "LearntHair", layouts);
  const root = fb.LearntHair.getSizePrefixedRootAsLearntHair(new flatbuffers.ByteBuffer(table));
  return makeLearntHair({
    hiddenCount: root.hiddenCount(),
    modeCount: root.modeCount(),
    inputWeights: root.inputWeightsArray()!.slice(),
    hiddenWeights: root.hiddenWeightsArray()!.slice(),
    bias: root.biasArray()!.slice(),
    outputWeights: root.outputWeightsArray()!.slice(),
    most: root.mostArray()!.slice(),
    error: root.error(),
    lowError: root.lowError(),
  });
}
