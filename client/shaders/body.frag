#include "scene.glsl"
#include "character.glsl"
#include "hair_light.glsl"

in vec3 position_scene;
in vec3 normal_scene;
in vec4 light_sides;
in vec2 light_ends;
in vec4 light_changes;
in float roots;
flat in int row;

out vec4 colour;

// Red light travels furthest under the skin, so it reaches furthest beyond the terminator.
vec3 wrapped(float n_l) {
  const vec3 wrap = vec3(0.34, 0.20, 0.15);
  vec3 x = clamp((n_l + wrap) / (1.0 + wrap), 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x) * 0.35 + x * 0.65;
}

float sheen(vec3 n, vec3 l, vec3 v) {
  vec3 h = normalize(l + v + 1e-5);
  float fresnel = 0.035 + 0.6 * pow(clamp(1.0 - dot(v, h), 0.0, 1.0), 5.0);
  return fresnel * (1.6 * pow(max(dot(n, h), 0.0), 22.0) + 1.2 * pow(max(dot(n, h), 0.0), 6.0)) * max(dot(n, l), 0.0);
}

void main() {
  vec3 n = normalize(normal_scene + 1e-6);
  vec3 v = normalize(cameraPosition - position_scene);
  if (dot(n, v) < -0.3) n = -n;
  // The scalp has the colour of hair at its roots (hair_albedo), so that partings show no light streaks.
  vec3 albedo = mix(record(row, 5).rgb, record(row, 2).rgb * 0.55, roots);
  vec4 rotation = record(row, 0);
  float size = 1.0 + record(row, 4).w;
  float ambient = min(ambient_transmittance(light_sides, light_ends) * light_changes.w, 1.0);
  vec3 sum = albedo * mix(ambient_below, ambient_above, 0.5 + 0.5 * n.y) *
             pow(vec3(ambient), 1.3 - albedo);  // where little light arrives, skin lights skin, warmly
  for (int i = 0; i < 3; ++i) {
    vec3 l = light_direction[i];
    float left = min(transmittance(light_sides, light_ends, to_head_axes(rotation, size, l)) * light_changes[i], 1.0);
    sum += (albedo * wrapped(dot(n, l)) + (1.0 - roots) * sheen(n, l, v)) * light_colour[i] * left;
  }
  colour = vec4(to_target_through_fog(sum, position_scene), 1.0);
}
