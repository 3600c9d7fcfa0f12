#include "scene.glsl"
#include "hair_light.glsl"
#include "coverage.glsl"

in vec3 position_scene;
in vec3 normal_scene;
in vec3 cord_side;
in vec4 light_sides;
in vec2 light_ends;
in vec4 albedo_opacity;
flat in vec4 rotation;
flat in float size;

out vec4 colour;

vec3 cloth_light(vec3 n, vec3 v, vec3 l, vec3 albedo, float thin) {
  float facing = dot(n, l);
  vec3 h = normalize(l + v + 1e-5);
  float through = 0.45 * thin * max(-facing, 0.0);
  return albedo * (max(facing, 0.0) + through) + vec3(0.12) * pow(max(dot(n, h), 0.0), 14.0) * max(facing, 0.0);
}

void main() {
  vec3 v = normalize(cameraPosition - position_scene);
  vec3 n = normalize(normal_scene + 1e-6);
  if (dot(n, v) < 0.0) n = -n;  // light both sides
  float across2 = dot(cord_side, cord_side);
  if (across2 > 0.0) n = normalize(n * sqrt(max(1.0 - across2, 0.05)) + cord_side);
  vec4 albedo = albedo_opacity;
  // Cloth seen at a slant is denser.
  float seen = albedo.a >= 1.0 ? 1.0 : 1.0 - pow(1.0 - albedo.a, 1.0 / max(abs(dot(n, v)), 0.15));
  float drawn = woven(seen);
  if (drawn <= 0.0) discard;
  float ambient = ambient_transmittance(light_sides, light_ends);
  vec3 sum = albedo.rgb * mix(ambient_below, ambient_above, 0.5 + 0.5 * n.y) * ambient;
  for (int i = 0; i < 3; ++i) {
    float left = transmittance(light_sides, light_ends, to_head_axes(rotation, size, light_direction[i]));
    sum += cloth_light(n, v, light_direction[i], albedo.rgb, 1.0 - 0.6 * albedo.a) * light_colour[i] * left;
  }
  colour = vec4(to_target_through_fog(sum, position_scene), drawn);
}
