#version 300 es
precision mediump float;
in vec4 colour_seen;
uniform float is_point;
out vec4 colour_out;

void main() {
  vec2 from_centre = 2.0 * gl_PointCoord - 1.0;
  if (is_point > 0.5 && dot(from_centre, from_centre) > 1.0) discard;
  colour_out = colour_seen;
}
