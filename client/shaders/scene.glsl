#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;

// Included by all shaders. Lengths in m, linear RGB. *Scene space* is the world, or the world relative to a near place
// where floats are precise enough. The camera's uniforms have the names that three.js sets.
uniform mat4 viewMatrix;
uniform mat4 projectionMatrix;
uniform vec3 cameraPosition;
uniform vec2 viewport_px;
uniform float samples;  // for each pixel; 1 without alpha to coverage

uniform vec3 light_direction[3];  // key, fill, rim: unit, towards the light, scene axes
uniform vec3 light_colour[3];
uniform vec3 ambient_above;
uniform vec3 ambient_below;
uniform float exposure;
uniform vec3 fog_colour;
uniform vec3 fog_range;  // begins and is complete at these depths, m; density, 1/m, of fog that becomes denser; 0 0 0: none
uniform float encode_srgb;  // 1: the target stores the value unchanged, so encode sRGB; 0: the target encodes it

vec4 to_clip(vec3 position_scene) { return projectionMatrix * (viewMatrix * vec4(position_scene, 1.0)); }

// Pixels in a metre where clip.w is 1. The cameras of a cube map draw upside down.
float px_per_m() { return 0.5 * viewport_px.y * abs(projectionMatrix[1][1]); }

const vec4 kNowhere = vec4(0.0, 0.0, 2.0, 1.0);  // beyond the far plane: a vertex here is not drawn

uint scramble(uint x) {  // PCG
  x = x * 747796405u + 2891336453u;
  x = ((x >> ((x >> 28u) + 4u)) ^ x) * 277803737u;
  return (x >> 22u) ^ x;
}

vec4 random4(uint seed) {  // in [0, 1)
  uvec4 bits;
  bits.x = scramble(seed);
  bits.y = scramble(bits.x);
  bits.z = scramble(bits.y);
  bits.w = scramble(bits.z);
  return vec4(bits >> 8u) / 16777216.0;
}

vec3 rotate(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }
vec3 rotate_back(vec4 q, vec3 v) { return rotate(vec4(-q.xyz, q.w), v); }

// A direction of the scene in the axes of a head with that rotation and size, and the other way round.
vec3 to_head_axes(vec4 rotation, float size, vec3 v) { return sign(size) * rotate_back(rotation, v); }
vec3 to_scene_axes(vec4 rotation, float size, vec3 v) { return sign(size) * rotate(rotation, v); }

// Linear up to 0.6, then a shoulder that never reaches 1.
vec3 tone_map(vec3 colour) {
  vec3 x = colour * exposure;
  return mix(x, 1.0 - 0.4 * exp((0.6 - x) / 0.4), step(0.6, x));
}

vec3 to_target(vec3 linear) {
  vec3 c = clamp(linear, 0.0, 1.0);
  vec3 srgb = mix(c * 12.92, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
  return mix(c, srgb, encode_srgb);
}

// Light at a place, as the target stores it: with fog, which like in three.js is mixed in after the encoding.
vec3 to_target_through_fog(vec3 light, vec3 position_scene) {
  vec3 stored = to_target(tone_map(light));
  float depth = -(viewMatrix * vec4(position_scene, 1.0)).z;
  float fog = fog_range.z > 0.0   ? 1.0 - exp(-fog_range.z * fog_range.z * depth * depth)
              : fog_range.y > 0.0 ? smoothstep(fog_range.x, fog_range.y, depth)
                                  : 0.0;
  return mix(stored, to_target(fog_colour), fog);
}
