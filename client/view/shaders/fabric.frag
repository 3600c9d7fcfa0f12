// Both sides are lit. Light and sight come through thin cloth by holes of a pixel, which need no sorting against hair.
in vec3 position_world;
in vec3 normal_world;
in vec3 fibre_world;
in vec3 light_left;
in vec4 albedo_opacity;
in vec3 place_on_strip;

out vec4 colour;

const float kHairsAcross = 24.0;  // of a strip's texture

float chance(vec2 at) { return fract(sin(dot(at, vec2(12.9898, 78.233))) * 43758.5453); }

// Bayer's 4x4 thresholds in (0, 1).
float threshold() {
  ivec2 at = ivec2(gl_FragCoord.xy) & 3;
  int low = ((at.x ^ at.y) & 1) * 2 + (at.y & 1);
  int high = (((at.x >> 1) ^ (at.y >> 1)) & 1) * 2 + (at.y >> 1);
  return (float(low * 4 + high) + 0.5) / 16.0;
}

vec3 cloth_light(vec3 n, vec3 v, vec3 l, vec3 albedo, float thin) {
  float facing = dot(n, l);
  vec3 h = normalize(l + v + 1e-5);
  float through = 0.45 * thin * max(-facing, 0.0);
  return albedo * (max(facing, 0.0) + through) + vec3(0.12) * pow(max(dot(n, h), 0.0), 14.0) * max(facing, 0.0);
}

// Fibres of chance shade and length: a strip is ragged at its sides and at its tip.
vec4 hair_of_strip(vec3 albedo) {
  float hair = floor(place_on_strip.x * kHairsAcross);
  vec4 luck = vec4(chance(vec2(hair, place_on_strip.z)), chance(vec2(hair, place_on_strip.z + 0.3)),
                   chance(vec2(hair, place_on_strip.z + 0.6)), chance(vec2(hair, place_on_strip.z + 0.9)));
  float side = abs(2.0 * place_on_strip.x - 1.0);
  float s = place_on_strip.y;
  if (s > 1.0 - 0.18 * luck.x || luck.y < smoothstep(0.55, 1.0, side) * smoothstep(0.02, 0.4, s) || luck.w < 0.35 * s) discard;
  albedo *= mix(0.7, 1.35, luck.z) * mix(0.6, 1.0, smoothstep(0.0, 0.2, s)) * mix(1.0, 1.2, s);
  return vec4(min(albedo, vec3(0.95)), luck.w);
}

void main() {
  vec3 v = normalize(eye.xyz - position_world);
  vec3 n = normalize(normal_world + 1e-6);
  if (dot(n, v) < 0.0) n = -n;
  bool hair = dot(fibre_world, fibre_world) > 0.25;
  vec4 albedo = albedo_opacity;
  vec4 luck = vec4(0.5);
  if (hair) {
    vec4 texture_of_hair = hair_of_strip(albedo.rgb);
    albedo.rgb = texture_of_hair.rgb;
    luck = vec4(0.5, 0.5, chance(place_on_strip.xz), texture_of_hair.w);
  } else {
    // Seen at a slant, cloth is denser.
    float seen = 1.0 - pow(1.0 - albedo.a, 1.0 / max(abs(dot(n, v)), 0.15));
    if (seen < threshold()) discard;
  }
  vec3 c = light_coordinates(position_world + 0.004 * n + 0.003 * light_direction[0].xyz);
  vec3 left = vec3(in_light_map(c) ? body_light_left(c) * hair_light_left(c) : 1.0, light_left.yz);
  vec3 sum = albedo.rgb * mix(ambient_below.rgb, ambient_above.rgb, 0.5 + 0.5 * n.y) * light_left.x;
  for (int i = 0; i < 3; ++i) {
    vec3 l = light_direction[i].xyz;
    vec3 one = hair ? hair_light(normalize(fibre_world), v, l, albedo.rgb, luck)
                    : cloth_light(n, v, l, albedo.rgb, 1.0 - 0.6 * albedo.a);
    sum += one * light_colour[i].rgb * left[i];
  }
  colour = vec4(tone_map(sum), 1.0);
}
