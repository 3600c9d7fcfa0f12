import type { BitReader } from "./bits";

/** 0, 1, 2, 3, ... to 0, -1, 1, -2, ...; of 16 bits. */
export function unfold16(z: number): number {
  return (((z >>> 1) ^ -(z & 1)) << 16) >> 16;
}

/** The same of 32 bits. */
export function unfold32(z: number): number {
  return (z >>> 1) ^ -(z & 1);
}

/** Exponential Golomb with parameter k, 0 to 31: a number of 32 bits, from 0 on. */
export function takeExponential(reader: BitReader, k: number): number {
  const zeros = reader.peekZeros(32 - k);
  reader.skip(zeros + 1);
  const bits = zeros + k;
  const low = reader.take(bits);
  // y - 2^k, modulo 2^32.
  return (low + (bits < 32 ? 2 ** bits : 0) - 2 ** k) >>> 0;
}
