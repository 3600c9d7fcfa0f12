#include "scene.glsl"
#include "character.glsl"
#include "strand_points.glsl"

// The second pass: each point moves along its deformed strand towards the root until it is no further from the root,
// along the strand, than at rest (core/ffd/strand_lengths.hpp explains it, and tests compare both).
flat in int row;
uniform highp usampler2D deformed_points;
uniform highp sampler2D rest_arcs;  // of the groom: arc length from the root, m; number of the point in its strand
out uvec4 point;

void main() {
  int first_row = point_rows(row).x;
  ivec2 at = ivec2(gl_FragCoord.xy) - ivec2(0, first_row);
  vec2 rest = texelFetch(rest_arcs, at, 0).xy;
  int own = at.x + kPointRow * at.y, root = own - int(rest.y);
  uvec4 before = texelFetch(deformed_points, texel_of(root, first_row), 0);
  point = before;
  float left_m = rest.x;
  for (int n = root + 1; n <= own; ++n) {
    point = texelFetch(deformed_points, texel_of(n, first_row), 0);
    float segment_m = distance(position_of(before), position_of(point));
    if (segment_m > left_m) {
      float t = left_m / segment_m;
      vec4 from = rotation_of(before), to = rotation_of(point);
      point = texel_with(StrandPoint(mix(position_of(before), position_of(point), t),
                                 mix(from, dot(from, to) < 0.0 ? -to : to, t)));
      return;
    }
    left_m -= segment_m;
    before = point;
  }
}
