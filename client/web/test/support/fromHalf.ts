/** The number that the bits of an IEEE half stand for. */
export function fromHalf(half: number): number {
  const exponent = (half >> 10) & 31;
  const part = half & 1023;
  const size = exponent === 0 ? part * 2 ** -24 : (1 + part / 1024) * 2 ** (exponent - 15);
  return half & 0x8000 ? -size : size;
}
