#version 300 es
// Coloured lines and points in the world.
precision highp float;
layout(location = 0) in vec3 position_world;
layout(location = 1) in vec4 colour;
uniform mat4 clip_from_world;
uniform float point_px;
uniform float alpha;
out vec4 colour_seen;

void main() {
  gl_Position = clip_from_world * vec4(position_world, 1.0);
  gl_PointSize = point_px;
  colour_seen = vec4(colour.rgb, colour.a * alpha);
}
