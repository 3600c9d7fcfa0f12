#include "scene.glsl"
#include "coverage.glsl"

in vec4 shade;
in vec3 across;
out vec4 colour;

void main() {
  float cover = shade.a * (samples < 2.0 ? clamp(across.y + 0.5 - abs(across.x), 0.0, 1.0) : 1.0);
  float drawn = dithered(cover, across.z, 0.5);
  if (drawn <= 0.0) discard;
  colour = vec4(shade.rgb, drawn);
}
