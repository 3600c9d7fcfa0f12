/** 0, 1, 2, 3, ... to 0, -1, 1, -2, ...; of 16 bits. */
export function unfold16(z: number): number {
  return (((z >>> 1) ^ -(z & 1)) << 16) >> 16;
}

/** The same of 32 bits. */
export function unfold32(z: number): number {
  return (z >>> 1) ^ -(z & 1);
}
