in vec3 position_world;
in vec3 normal_world;
in vec4 surroundings;

uniform vec3 skin;
uniform vec3 hair_albedo;

out vec4 colour;

// Red light travels furthest under the skin and so wraps furthest round the terminator.
vec3 wrapped(float n_l) {
  const vec3 wrap = vec3(0.34, 0.20, 0.15);
  vec3 x = clamp((n_l + wrap) / (1.0 + wrap), 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x) * 0.35 + x * 0.65;
}

float sheen(vec3 n, vec3 l, vec3 v) {
  vec3 h = normalize(l + v + 1e-5);
  float fresnel = 0.035 + 0.6 * pow(1.0 - max(dot(v, h), 0.0), 5.0);
  return fresnel * (1.6 * pow(max(dot(n, h), 0.0), 22.0) + 1.2 * pow(max(dot(n, h), 0.0), 6.0)) * max(dot(n, l), 0.0);
}

void main() {
  vec3 n = normalize(normal_world + 1e-6);
  vec3 v = normalize(eye.xyz - position_world);
  if (dot(n, v) < -0.3) n = -n;
  vec3 albedo = mix(skin, hair_albedo * 0.6, 0.85 * surroundings.w);

  vec3 c = light_coordinates(position_world + 0.003 * n + 0.002 * light_direction[0].xyz);
  float left = in_light_map(c) ? body_light_left(c) * hair_light_left(c) : 1.0;
  vec3 light_left = vec3(left, surroundings.yz);

  vec3 sum = albedo * mix(ambient_below.rgb, ambient_above.rgb, 0.5 + 0.5 * n.y) *
             pow(vec3(surroundings.x), 1.3 - albedo);  // skin lights skin, warmly, where little else does
  for (int i = 0; i < 3; ++i) {
    vec3 l = light_direction[i].xyz;
    sum += (albedo * wrapped(dot(n, l)) + (1.0 - surroundings.w) * sheen(n, l, v)) * light_colour[i].rgb * light_left[i];
  }
  colour = vec4(tone_map(sum), 1.0);
}
