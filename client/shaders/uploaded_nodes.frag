#include "scene.glsl"
#include "character.glsl"

// Copies the nodes of a lattice that does not move in modes.
uniform highp sampler2D uploaded_nodes;
flat in int row;
flat in int first_row;
out uvec4 node;

void main() {
  int from = int(record(row, kLatticeTexel + 2).w);
  node = uvec4(floatBitsToUint(texelFetch(uploaded_nodes, ivec2(gl_FragCoord.xy) + ivec2(0, from - first_row), 0).xyz), 0u);
}
