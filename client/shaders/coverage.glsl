// Coverage for targets of several samples: alpha becomes samples (alpha to coverage), so nothing needs sorting. A few
// samples have few steps between none and all: chance makes up for it, another at each hair and pixel.
uniform float samples;  // a pixel

float dithered(float cover, float number) {
  uint seed = uint(gl_FragCoord.x) * 1597334677u ^ uint(gl_FragCoord.y) * 3812015801u ^ floatBitsToUint(number);
  float chance = float(scramble(seed) >> 8u) / 16777216.0;
  if (samples < 2.0) return step(chance, cover);
  return clamp(cover + (chance - 0.5) * 0.5 * step(0.004, cover) * step(cover, 0.996), 0.0, 1.0);
}
