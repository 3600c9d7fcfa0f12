// How much of a pixel hair and cloth cover, as the alpha that fragment shaders write. Include scene.glsl first: it has
// `samples` and `scramble`.
//
// Targets have several samples: alpha becomes samples (alpha to coverage), so nothing needs sorting. A few samples give
// few steps of coverage; random rounding makes up for this.

// Alpha is less than the share of its samples by this part of a sample: GPUs that round it up, and those that round it
// to the nearest whole number, then count it alike.
const float kBelowCount = 0.3;
// The fraction of the golden ratio: its multiples, modulo 1, are spread evenly however many there are.
const float kGoldenRatio = 0.61803399;

// Returns the alpha for a whole number of samples, rounded by `chance` (0 ... 1); 1 for all, 0 for none.
float rounded_by(float cover, float chance) {
  float count = floor(clamp(cover, 0.0, 1.0) * samples + chance);
  return count < samples ? max(count - kBelowCount, 0.0) / samples : 1.0;
}

uniform int dither_seed;  // another number for each picture of an average; 0: a single picture

// A random number in [0, 1) for this pixel and this `number`, of 24 bits.
float chance_at_pixel(float number) {
  uint seed = uint(gl_FragCoord.x) * 1597334677u ^ uint(gl_FragCoord.y) * 3812015801u ^ floatBitsToUint(number);
  seed += uint(dither_seed) * 2654435769u;
  return float(scramble(seed) >> 8u) / 16777216.0;
}

// For hair: a random number per hair and pixel. The GPU always sets the same samples first, so hairs behind each other
// would hide in the same samples. `apart`, a share of the time, this therefore sets all samples or none.
float dithered(float cover, float number, float apart) {
  float chance = chance_at_pixel(number);
  // The last 14 bits are a second random number, which says nothing about the size of the whole one.
  return fract(chance * 1024.0) < apart ? step(chance, cover) : rounded_by(cover, chance);
}

// For cloth: even, with Bayer's 4x4 thresholds, which change from picture to picture of an average. Each lies in the
// middle of its sixteenth.
float woven(float cover) {
  ivec2 at = ivec2(gl_FragCoord.xy) & 3;
  int low = ((at.x ^ at.y) & 1) * 2 + (at.y & 1);
  int high = (((at.x >> 1) ^ (at.y >> 1)) & 1) * 2 + (at.y >> 1);
  // A small multiple keeps enough bits for its fraction.
  float shift = kGoldenRatio * float(dither_seed & 1023);
  return rounded_by(cover, fract((float(low * 4 + high) + 0.5) / 16.0 + shift));
}
