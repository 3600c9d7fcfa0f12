#include "scene.glsl"

in vec2 uv;
uniform vec3 top;
uniform vec3 bottom;
out vec4 colour;

void main() {
  float height = smoothstep(0.0, 1.0, uv.y);
  float corner = length((uv - vec2(0.5, 0.55)) * vec2(1.0, 0.8));
  colour = vec4(to_target(mix(bottom, top, height) * (1.0 - 0.22 * corner * corner)), 1.0);
}
