// Light on hair and through hair.

// The share of light from `direction` (unit, head axes) that reaches a place of the resting hair, from the shares along
// the six axes: +x -x +y -y, +z -z.
float transmittance(vec4 sides, vec2 ends, vec3 direction) {
  vec3 squared = direction * direction;
  return squared.x * (direction.x > 0.0 ? sides.x : sides.y) + squared.y * (direction.y > 0.0 ? sides.z : sides.w) +
         squared.z * (direction.z > 0.0 ? ends.x : ends.y);
}

float ambient_transmittance(vec4 sides, vec2 ends) {
  return (1.5 * sides.z + 0.5 * sides.w + sides.x + sides.y + ends.x + ends.y) / 6.0;
}

// Of the hair that is lit, 0 to 1; main sets it. The powers of the highlights below are for this value.
const float kRoughnessUsual = 77.0 / 255.0;
float roughness = kRoughnessUsual;

// Rougher hair has a wider and weaker highlight.
float lobe(float t_h, float power) {
  float sharper = clamp(kRoughnessUsual / max(roughness, 0.1), 0.3, 3.0);
  return sharper * smoothstep(-1.0, 0.0, t_h) * pow(max(1.0 - t_h * t_h, 1e-4), 0.5 * power * sharper * sharper);
}

// Kajiya and Kay's diffuse light and highlight. The highlight appears twice with the tangent shifted (Scheuermann):
// towards the root and white for light reflected at the surface, towards the tip and coloured for light that passed
// through the hair. `chance`: four random numbers in [0, 1), constant for the hair.
vec3 hair_light(vec3 t, vec3 v, vec3 l, vec3 albedo, vec4 chance) {
  vec3 n = normalize(v - t * dot(t, v) + 1e-5);
  vec3 h = normalize(l + v + 1e-5);
  float shift = 0.05 * (chance.z - 0.5);
  float first = lobe(dot(normalize(t - n * (0.10 + shift)), h), 240.0);
  float second = lobe(dot(normalize(t + n * (0.14 + shift)), h), 40.0);
  float t_l = dot(t, l);
  float diffuse = sqrt(max(1.0 - t_l * t_l, 0.0));
  float facing = 0.5 + 0.5 * dot(n, l);
  float glint = 0.4 + 1.2 * chance.w;
  float through = pow(max(-dot(v, l), 0.0), 6.0);
  return albedo * diffuse * mix(0.35, 1.0, facing) + vec3(0.40) * first * glint * facing +
         2.4 * sqrt(albedo) * albedo / (1.0 + 1.5 * albedo) * second * (0.7 + 0.6 * chance.y) * facing + 0.5 * albedo * through * diffuse;
}

// Each hair has its own shade; it is darker at the root, lighter at the tip. `s`: 0 at the root, 1 at the tip.
vec3 hair_albedo(vec3 albedo, vec4 chance, float s) {
  vec3 own = albedo * mix(0.75, 1.3, chance.x) * mix(vec3(1.0), vec3(1.12, 1.0, 0.86), chance.y - 0.4);
  return min(own * mix(0.55, 1.0, smoothstep(0.0, 0.2, s)) * mix(1.0, 1.2, s), vec3(0.95));
}

// All lights on hair at `position` (scene) with unit tangent `t`; `rotation`, `size`: of the head; `change`: of the
// lights since the resting hair (light_change).
vec3 shade_hair(vec3 position, vec3 t, vec4 rotation, float size, vec3 albedo, vec4 chance, vec4 sides, vec2 ends, vec4 change) {
  vec3 v = normalize(cameraPosition - position);
  float ambient = min(ambient_transmittance(sides, ends) * change.w, 1.0);
  vec3 sum = albedo * mix(ambient_below, ambient_above, ambient) * ambient;
  for (int i = 0; i < 3; ++i) {
    float left = min(transmittance(sides, ends, to_head_axes(rotation, size, light_direction[i])) * change[i], 1.0);
    // Light hair transmits and scatters light that dark hair absorbs.
    vec3 passed = pow(vec3(max(left, 1e-3)), 1.0 - 0.75 * sqrt(albedo));
    sum += hair_light(t, v, light_direction[i], albedo, chance) * light_colour[i] * passed;
  }
  return sum;
}
