#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;

// Filters the large picture to its final size: a tent filter over the samples of a pixel and their neighbours, in
// linear light (the source decodes sRGB), then sRGB with half a step of noise against banding.
in vec2 uv;
uniform sampler2D source;
uniform int supersample;
out vec4 colour;

float noise(uvec2 p) {
  uint x = p.x * 1597334677u + p.y * 3812015801u;
  x = (x ^ (x >> 16u)) * 2246822519u;
  return float((x ^ (x >> 13u)) >> 8u) / 16777216.0 - 0.5;
}

void main() {
  ivec2 last = textureSize(source, 0) - 1;
  ivec2 corner = ivec2(gl_FragCoord.xy) * supersample;
  int reach = supersample / 2;
  vec3 sum = vec3(0.0);
  float weights = 0.0;
  for (int y = -reach; y < supersample + reach; ++y) {
    for (int x = -reach; x < supersample + reach; ++x) {
      vec2 away = abs((vec2(x, y) + 0.5) / float(supersample) - 0.5);
      float weight = max(1.0 - away.x, 0.0) * max(1.0 - away.y, 0.0);
      sum += weight * texelFetch(source, clamp(corner + ivec2(x, y), ivec2(0), last), 0).rgb;
      weights += weight;
    }
  }
  vec3 c = clamp(sum / weights, 0.0, 1.0);
  c = mix(c * 12.92, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
  colour = vec4(c + noise(uvec2(gl_FragCoord.xy)) / 255.0, 1.0);
}
