#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DShadow;

// What all shaders of a picture share: this text comes first in each of them. Lengths in m, world space, linear RGB.
layout(std140) uniform Studio {
  mat4 view_projection;
  mat4 light_projection;    // world to the key light's clip space (orthographic)
  vec4 eye;                 // xyz; w = exposure
  vec4 light_direction[3];  // key, fill, rim: unit, towards the light
  vec4 light_colour[3];
  vec4 ambient_above;
  vec4 ambient_below;
  vec4 picture;      // width and height, px; px a metre covers at unit distance;
                     // half-width of the blur of the hair's shadow, of the light map's side
  vec4 light_map;    // depth range, m; texel, m; 1 / side in texels; optical depth that saturates a layer
  vec4 layer_depth;  // m behind the first hair at which the four layers end
};

uniform sampler2D hair_first_depth;   // depth of the first hair from the key light
uniform sampler2D hair_layers;        // optical depth of hair up to each layer's end
uniform sampler2DShadow body_depth;

// Deep opacity maps (Yuksel and Keyser 2008): optical depth between the key light and a point.
float hair_depth_at(vec2 uv, float depth) {
  float behind = (depth - textureLod(hair_first_depth, uv, 0.0).r) * light_map.x;
  vec4 tau = textureLod(hair_layers, uv, 0.0) * light_map.w;
  vec4 begin = vec4(0.0, layer_depth.xyz);
  vec4 part = clamp((behind - begin) / (layer_depth - begin), 0.0, 1.0);
  return dot(part, tau - vec4(0.0, tau.xyz));
}

vec3 light_coordinates(vec3 position_world) {
  vec4 clip = light_projection * vec4(position_world, 1.0);
  return clip.xyz * 0.5 + 0.5;
}

bool in_light_map(vec3 c) {
  return all(greaterThan(c, vec3(0.0))) && all(lessThan(c, vec3(1.0)));
}

// Linear to 0.6, then a shoulder that never reaches 1.
vec3 tone_map(vec3 colour) {
  vec3 x = colour * eye.w;
  return mix(x, 1.0 - 0.4 * exp((0.6 - x) / 0.4), step(0.6, x));
}

// Of the key light, what the body and cloth leave at light_coordinates c.
float body_light_left(vec3 c) {
  float lit = 0.0;
  for (int y = -1; y <= 1; ++y)
    for (int x = -1; x <= 1; ++x)
      lit += textureLod(body_depth, vec3(c.xy + 1.3 * vec2(x, y) * light_map.z, c.z), 0.0);
  return lit / 9.0;
}

// What the hair leaves there.
float hair_light_left(vec3 c) {
  float tau = 0.0;
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x) tau += hair_depth_at(c.xy + (vec2(x, y) - 1.5) * 0.9 * picture.w, c.z);
  return exp(-0.4 * tau / 16.0);
}

float lobe(float t_h, float power) {
  return smoothstep(-1.0, 0.0, t_h) * pow(max(1.0 - t_h * t_h, 1e-4), 0.5 * power);
}

// Kajiya and Kay's diffuse and highlight; the highlight twice with the tangent shifted (Scheuermann): towards the
// root and white for light off the surface, towards the tip and coloured for light that went through the hair.
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
