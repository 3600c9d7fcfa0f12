#include "scene.glsl"

// A point's share of the four cells around it.
flat in vec2 centre;
flat in vec4 amount;
out vec4 density;

void main() {
  vec2 near = max(1.0 - abs(gl_FragCoord.xy - centre), 0.0);
  density = amount * near.x * near.y;
}
