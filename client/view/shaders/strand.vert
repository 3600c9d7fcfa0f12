// A strand as a ribbon that faces the camera. Every vertex comes twice: even ones on the left, odd ones on the right.
// Shading is done here, not by the pixel: a ribbon is a pixel or two wide, and its points lie close.
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 tangent;   // xyz unit, root to tip
layout(location = 2) in vec4 along;     // fraction of the strand's length; light left of: ambient, fill, rim
layout(location = 3) in uint strand;

uniform vec4 hair;              // albedo; width at the root, m
uniform float follower_spread;  // m

out vec4 shade;          // colour; coverage of the core
out vec2 across;         // px from the middle; half of the drawn width, px

uint scramble(uint x) {  // PCG
  x = x * 747796405u + 2891336453u;
  x = ((x >> ((x >> 28u) + 4u)) ^ x) * 277803737u;
  return (x >> 22u) ^ x;
}

vec4 random4(uint seed) {
  uvec4 bits;
  bits.x = scramble(seed);
  bits.y = scramble(bits.x);
  bits.z = scramble(bits.y);
  bits.w = scramble(bits.z);
  return vec4(bits >> 8u) / 16777216.0;
}

// Copies stray most in the middle; at the tips they gather again into locks.
vec3 follower_offset(vec4 chance, float s) {
  if (gl_InstanceID == 0) return vec3(0.0);
  float stray = follower_spread * mix(0.55, 1.0, smoothstep(0.0, 0.25, s)) * mix(1.0, 0.7, smoothstep(0.5, 1.0, s));
  float turn = 6.2832 * (chance.x + (chance.z - 0.5) * s);
  float z = 2.0 * chance.y - 1.0;
  return stray * vec3(sqrt(1.0 - z * z) * vec2(cos(turn), sin(turn)), z).xzy * sqrt(chance.w);
}

vec3 key_light_left(vec3 p, vec3 albedo) {
  vec3 c = light_coordinates(p);
  if (!in_light_map(c)) return vec3(1.0);
  float reach = picture.w;
  float tau = 0.0;
  tau += hair_depth_at(c.xy + reach * vec2(-0.5, -1.0), c.z);
  tau += hair_depth_at(c.xy + reach * vec2(1.0, -0.5), c.z);
  tau += hair_depth_at(c.xy + reach * vec2(0.5, 1.0), c.z);
  tau += hair_depth_at(c.xy + reach * vec2(-1.0, 0.5), c.z);
  float body = textureLod(body_depth, vec3(c.xy, c.z - 0.004 / light_map.x), 0.0);
  // Light hair passes and scatters what dark hair swallows.
  return body * exp(-0.4 * tau * (1.0 - 0.75 * sqrt(albedo)));
}

void main() {
  float s = along.x;
  vec4 chance = random4(strand * 16u + uint(gl_InstanceID));
  vec3 p = position + follower_offset(chance, s);
  vec3 t = normalize(tangent.xyz);
  vec3 to_eye = eye.xyz - p;
  vec3 v = normalize(to_eye);

  vec3 albedo = hair.rgb * mix(0.75, 1.3, chance.x) * mix(vec3(1.0), vec3(1.12, 1.0, 0.86), chance.y - 0.4);
  albedo = min(albedo * mix(0.55, 1.0, smoothstep(0.0, 0.2, s)) * mix(1.0, 1.2, s), vec3(0.95));
  vec3 colour = hair_light(t, v, light_direction[0].xyz, albedo, chance) * light_colour[0].rgb * key_light_left(p, albedo);
  colour += hair_light(t, v, light_direction[1].xyz, albedo, chance) * light_colour[1].rgb * along.z;
  colour += hair_light(t, v, light_direction[2].xyz, albedo, chance) * light_colour[2].rgb * along.w;
  colour += albedo * mix(ambient_below.rgb, ambient_above.rgb, along.y) * along.y;

  vec4 clip = view_projection * vec4(p, 1.0);
  vec4 ahead = view_projection * vec4(p + t * 1e-3, 1.0);
  vec2 pixel = 0.5 * picture.xy;
  vec2 direction = (ahead.xy * clip.w - clip.xy * ahead.w) * pixel;
  direction = dot(direction, direction) > 1e-20 ? normalize(direction) : vec2(1.0, 0.0);
  vec2 side = vec2(-direction.y, direction.x) * ((gl_VertexID & 1) == 0 ? -1.0 : 1.0);

  // Tips end at chance lengths, softly.
  float end = 1.0 - 0.12 * chance.z;
  float taper = mix(1.0, 0.45, s * s) * (1.0 - smoothstep(end - 0.12, end, s));
  float width_px = hair.w * taper * (gl_InstanceID == 0 ? 1.0 : 0.8) * picture.z / max(clip.w, 1e-3);
  float half_px = 0.5 * max(width_px, 1.0);
  float edge_px = half_px + 0.5;
  clip.xy += side * edge_px / pixel * clip.w;
  gl_Position = clip;
  shade = vec4(tone_map(colour), min(width_px, 1.0));
  across = vec2((gl_VertexID & 1) == 0 ? -edge_px : edge_px, half_px);
}
