// Strands as seen from the key light, as lines.
layout(location = 0) in vec3 position;
layout(location = 2) in vec4 along;

uniform float opacity;  // of one line in one texel

out float cover;

void main() {
  gl_Position = light_projection * vec4(position, 1.0);
  cover = opacity * mix(1.0, 0.4, along.x);
}
