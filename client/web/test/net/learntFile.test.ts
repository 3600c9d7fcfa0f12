import { describe, expect, it } from "vitest";
import { HairnetError } from "../../src/hair/hairnetError";
import type { LearntHair } from "../../src/hair/learntHair";
import { decodeLearnt } from "../../src/net/learntFile";
import { fromHex } from "../support/vectors";
import { learntVectors } from "../support/learntVectors";

function attempt(file: Uint8Array): LearntHair | HairnetError {
  try {
    return decodeLearnt(file);
  } catch (error) {
    if (!(error instanceof HairnetError)) throw error;
    expect(error.message).not.toMatch(/\n/);
    return error;
  }
}

/** Of counts, and of the bits of floats, as words of 32 bits. */
function checksumOf(hair: LearntHair): number {
  let sum = 0;
  const add = (word: number) => {
    sum = Math.imul(sum ^ word, 16_777_619);
  };
  const addFloats = (numbers: Float32Array) => new Uint32Array(numbers.buffer).forEach(add);
  add(hair.hiddenCount);
  add(hair.modeCount);
  for (const weights of [hair.inputWeights, hair.hiddenWeights, hair.bias, hair.outputWeights, hair.most])
    addFloats(weights.slice());
  addFloats(Float32Array.of(hair.error, hair.lowError));
  return sum >>> 0;
}

describe("files of learnt hair", () => {
  it("are read as C++ does", () => {
    const hair = decodeLearnt(fromHex(learntVectors.file));
    expect([hair.hiddenCount, hair.modeCount]).toEqual([20, 12]);
    expect(checksumOf(hair)).toBe(learntVectors.checksum);
  });

  it("are refused where C++ refuses them, and else read as C++ does", () => {
    for (const { name, file, checksum } of learntVectors.spoilt) {
      const got = attempt(fromHex(file));
      expect(got instanceof HairnetError ? null : checksumOf(got), name).toBe(checksum);
    }
    const refused = learntVectors.spoilt.filter((each) => each.checksum === null).length;
    expect(refused).toBeGreaterThan(learntVectors.spoilt.length / 4);
    expect(refused).toBeLessThan(learntVectors.spoilt.length);
  });

  it("leave nothing in the network that lies in the file, wherever it lies in memory", () => {
    const bytes = fromHex(learntVectors.file);
    const moved = new Uint8Array(bytes.length + 3).subarray(3);
    moved.set(bytes);
    const hair = decodeLearnt(moved);
    moved.fill(0);
    expect(checksumOf(hair)).toBe(learntVectors.checksum);
  });
});
