// Coverage for targets with several samples: alpha becomes samples (alpha to coverage), so nothing needs sorting. A few
// samples give few steps of coverage; random rounding makes up for this. Returns the alpha for a whole number of
// samples, rounded by `chance` (0 ... 1). It is slightly less than their share, so that all GPUs count it alike, but 1
// for all. 0: none.
float rounded_by(float cover, float chance) {
  float count = floor(clamp(cover, 0.0, 1.0) * samples + chance);
  return count < samples ? max(count - 0.3, 0.0) / samples : 1.0;
}

uniform int dither_seed;  // another number for each picture of an average; 0: a single picture

float chance_at_pixel(float number) {
  uint seed = uint(gl_FragCoord.x) * 1597334677u ^ uint(gl_FragCoord.y) * 3812015801u ^ floatBitsToUint(number);
  seed += uint(dither_seed) * 2654435769u;
  return float(scramble(seed) >> 8u) / 16777216.0;
}

// For hair: a random number per hair and pixel. The GPU always sets the same samples first, so hairs behind each other
// would hide in the same samples. `apart`, a share of the time, this therefore sets all samples or none.
float dithered(float cover, float number, float apart) {
  float chance = chance_at_pixel(number);
  return fract(chance * 1024.0) < apart ? step(chance, cover) : rounded_by(cover, chance);
}

// For cloth: even, with Bayer's 4x4 thresholds, which change from picture to picture of an average.
float woven(float cover) {
  ivec2 at = ivec2(gl_FragCoord.xy) & 3;
  int low = ((at.x ^ at.y) & 1) * 2 + (at.y & 1);
  int high = (((at.x >> 1) ^ (at.y >> 1)) & 1) * 2 + (at.y >> 1);
  return rounded_by(cover, fract((float(low * 4 + high) + 0.5) / 16.0 + 0.61803399 * float(dither_seed & 1023)));
}
