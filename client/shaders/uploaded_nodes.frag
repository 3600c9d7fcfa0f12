#include "scene.glsl"
#include "character.glsl"

// Copies nodes that were not summed up here.
uniform highp sampler2D uploaded_nodes;
flat in int row;
flat in int first_row;
out uvec4 node;

void main() {
  int from = int(record(row, kLatticeTexel + 2).w);
  ivec2 at = ivec2(gl_FragCoord.xy) + ivec2(0, from - first_row);
  node = uvec4(floatBitsToUint(texelFetch(uploaded_nodes, at, 0).xyz), 0u);
}
