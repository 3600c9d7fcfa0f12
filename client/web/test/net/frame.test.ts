import { describe, expect, it } from "vitest";
import { poseFault } from "../../src/hair/pose";
import { CoefficientCode } from "../../src/net/codec/coefficientCode";
import { decodeFrame, type DecodedFrame } from "../../src/net/codec/frame";
import { fromHex, furthest, seeded, vectors } from "../support/vectors";

interface FrameVector {
  /** index of its deviations */
  code: number;
  bytes: string;
  decoded: { pose: number[]; coefficients: number[] } | null;
}

interface Vectors {
  deviations: number[][];
  /** of prefixes of 0, 5, 10, ... bytes: the coefficients that they have, or -1 if refused */
  frames: (FrameVector & { prefixes: number[] })[];
  spoilt: FrameVector[];
}

const { deviations, frames, spoilt } = vectors<Vectors>("frame.json");
const codes = deviations.map((each) => new CoefficientCode(Float32Array.from(each)));
const kPrefixBytes = 5;
const kUsual = frames.filter((each) => each.code === 0 && each.decoded!.coefficients.some((c) => c !== 0));

function expectSame(got: DecodedFrame | null, want: FrameVector["decoded"], name: string): void {
  expect(got !== null, name).toBe(want !== null);
  if (!got || !want) return;
  expect(furthest(got.pose, want.pose), name).toBe(0);
  expect(furthest(got.coefficients, want.coefficients), name).toBe(0);
}

describe("frames", () => {
  it("decodes every frame of the C++ encoder to the same pose and coefficients, bit for bit", () => {
    frames.forEach((each, n) => {
      expect(each.decoded).not.toBeNull();
      expectSame(decodeFrame(fromHex(each.bytes), codes[each.code]), each.decoded, `frame ${n}`);
    });
  });

  it("decodes prefixes to as many coefficients as C++ does", () => {
    let refused = 0;
    frames.forEach((each, n) => {
      const bytes = fromHex(each.bytes);
      each.prefixes.forEach((count, i) => {
        const name = `frame ${n}, ${i * kPrefixBytes} bytes`;
        if (count < 0) ++refused;
        const { pose, coefficients } = each.decoded!;
        const first = coefficients.map((c, k) => (k < count ? c : 0));
        const want = count < 0 ? null : { pose, coefficients: first };
        expectSame(decodeFrame(bytes.subarray(0, i * kPrefixBytes), codes[each.code]), want, name);
      });
    });
    expect(refused).toBeGreaterThan(frames.length);
  });

  it("refuses the spoilt bytes that C++ refuses, and decodes the others to the same", () => {
    spoilt.forEach((each, n) => {
      expectSame(decodeFrame(fromHex(each.bytes), codes[each.code]), each.decoded, `spoilt ${n}`);
    });
    const refused = spoilt.filter((each) => each.decoded === null).length;
    expect(refused).toBeGreaterThan(500);
    expect(refused).toBeLessThan(spoilt.length - 500);
  });

  it("decodes each by itself, whatever was decoded before it", () => {
    const random = seeded(4);
    for (let n = 0; n < 2000; ++n) {
      const each = frames[Math.floor(random() * frames.length)];
      const other = spoilt[Math.floor(random() * spoilt.length)];
      decodeFrame(fromHex(other.bytes), codes[other.code]);
      expectSame(decodeFrame(fromHex(each.bytes), codes[each.code]), each.decoded, each.bytes);
    }
  });

  it("has more coefficients the more bytes there are, and changes none", () => {
    expect(kUsual.length).toBeGreaterThan(10);
    for (const each of kUsual) {
      const bytes = fromHex(each.bytes);
      const { pose, coefficients } = each.decoded!;
      let count = 0;
      for (let size = 0; size <= bytes.length; ++size) {
        const got = decodeFrame(bytes.subarray(0, size), codes[0]);
        expect(got === null).toBe(decodeFrame(bytes.subarray(0, size), null) === null);
        if (!got) {
          expect(count).toBe(0);
          continue;
        }
        expect(furthest(got.pose, pose)).toBe(0);
        while (count < coefficients.length && got.coefficients[count] === coefficients[count]) ++count;
        expect(got.coefficients.subarray(count).every((c) => c === 0)).toBe(true);
      }
      expect(count).toBe(coefficients.length);
    }
  });

  it("refuses bytes that are left over, and bits that are set after the last coefficient", () => {
    for (const each of kUsual) {
      const bytes = fromHex(each.bytes);
      expect(decodeFrame(Uint8Array.of(...bytes, 0), codes[0])).toBeNull();
    }
    const last = kUsual.find((each) => fromHex(each.bytes).at(-1)! < 0x80)!;
    const bytes = fromHex(last.bytes);
    bytes[bytes.length - 1] |= 0x80;
    expect(decodeFrame(bytes, codes[0])).toBeNull();
  });

  it("decodes the pose alone without a basis, whatever follows it", () => {
    for (const each of frames) {
      const got = decodeFrame(fromHex(each.bytes), null)!;
      expect(furthest(got.pose, each.decoded!.pose)).toBe(0);
      expect(got.coefficients.length).toBe(0);
    }
  });

  it("takes any bytes at all without harm", () => {
    const random = seeded(9);
    let refused = 0;
    for (let n = 0; n < 20_000; ++n) {
      const bytes = Uint8Array.from({ length: random() * 200 }, () => random() * 256);
      if (n % 2 === 0 && bytes.length > 0) bytes[0] &= 0xe7; // a head that is near
      const got = decodeFrame(bytes, codes[0]);
      if (!got) {
        ++refused;
        continue;
      }
      for (let i = 0; i < got.pose.length; ++i) expect(Math.abs(got.pose[i])).toBeLessThanOrEqual(20_000);
      const near = got.pose.map((x, i) => (i % 7 < 4 ? x : 0));
      expect(poseFault(near)).toBeNull();
      expect(got.coefficients.every((c) => Math.abs(c) <= 5000)).toBe(true);
    }
    expect(refused).toBeGreaterThan(1000);
    expect(refused).toBeLessThan(19_000);
  });
});
