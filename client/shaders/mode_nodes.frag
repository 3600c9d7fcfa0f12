#include "scene.glsl"
#include "character.glsl"

// The displacements of a lattice's nodes from the coefficients of its modes (core/modes/basis.hpp). The texture of the
// modes has, for each of them, the rows of all nodes of the grid.
uniform highp sampler2D modes;
flat in int row;
flat in int first_row;
out uvec4 node;  // the bits of three floats

vec3 in_mode(ivec2 at, int mode, int rows) {
  return texelFetch(modes, at + ivec2(0, mode * rows), 0).xyz;
}

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy) - ivec2(0, first_row);
  int rows = node_rows(row), count = int(record(row, kLatticeTexel + 2).w);
  vec3 u = vec3(0.0);
  for (int mode = 0; mode < count; mode += 4) {
    vec4 c = record(row, kCoefficientTexel + mode / 4);
    u += c.x * in_mode(at, mode, rows) + c.y * in_mode(at, mode + 1, rows) +
         c.z * in_mode(at, mode + 2, rows) + c.w * in_mode(at, mode + 3, rows);
  }
  node = uvec4(floatBitsToUint(u), 0u);
}
