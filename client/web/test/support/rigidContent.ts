/** The content of a frame that is bones alone, of order 0: all of them at rest. */
export function rigidContent(): Uint8Array {
  // Choices 0; then for each bone: largest is w (3), positive; six zeros and the largest's own, each of one bit.
  const bits: number[] = new Array(14).fill(0);
  for (let bone = 0; bone < 5; ++bone) bits.push(1, 1, 0, 1, 1, 1, 1, 1, 1, 1);
  const bytes = new Uint8Array(Math.ceil(bits.length / 8));
  for (const [i, bit] of bits.entries()) bytes[i >> 3] |= bit << (i & 7);
  return bytes;
}
