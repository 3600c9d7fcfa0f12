const float = new Float32Array(1);
const bits = new Uint32Array(float.buffer);

/** The bits of the IEEE half nearest to x; x is clamped to 6e4. Numbers too small for a normal half become 0. */
export function toHalf(x: number): number {
  float[0] = Math.min(Math.max(x, -6e4), 6e4);
  const sign = (bits[0] >>> 16) & 0x8000;
  // Adds half a unit in the half's last place, then truncates: rounds to nearest.
  const rounded = (bits[0] & 0x7fffffff) + 0x1000;
  if (rounded < 0x38800000) return sign;
  return sign | ((rounded - 0x38000000) >>> 13);
}
