#include "scene.glsl"

// Makes the texture of cards: four ribbons side by side. Each has hairs from the root (y = 0) to the tip, of random
// shade, thickness and length, that drift across it and gather at its tip.
in vec2 uv;
out vec4 colour;

const int kHairs = 40;
const float kSway = 0.05;

void main() {
  float ribbon = floor(uv.x * 4.0);
  vec2 at = vec2(fract(uv.x * 4.0), uv.y);
  vec4 best = vec4(0.5, 0.5, 0.5, 0.0);
  float nearest = 0.0;
  for (int h = 0; h < kHairs; ++h) {
    vec4 chance = random4(uint(h) + 1000u * uint(ribbon));
    vec4 more = random4(uint(h) + 1000u * uint(ribbon) + 500u);
    float centre = mix(0.06, 0.94, (float(h) + chance.x) / float(kHairs));
    float gathered = mix(centre, 0.5, 0.35 * at.y * at.y * more.x);
    float x = gathered + kSway * (sin(6.2832 * (chance.y + at.y * mix(0.4, 1.3, chance.z))) - sin(6.2832 * chance.y)) * at.y;
    float end = mix(0.72, 1.0, sqrt(chance.w));
    float begin = 0.07 * more.y * chance.w;  // ragged at the hairline
    float width = mix(0.018, 0.034, more.y) * (1.0 - 0.6 * at.y) * smoothstep(begin, begin + 0.03, at.y + 0.02) *
                  (1.0 - smoothstep(end - 0.12, end, at.y));
    float edge = abs(2.0 * centre - 1.0);
    float cover = (1.0 - smoothstep(0.6 * width, width, abs(at.x - x))) * (1.0 - 0.7 * smoothstep(0.6, 1.0, edge));
    float front = cover * (0.2 + more.z);
    if (front > nearest) {
      nearest = front;
      best.xyz = vec3(more.z, chance.z, more.w);
    }
    best.a = max(best.a, cover);
  }
  colour = best;
}
