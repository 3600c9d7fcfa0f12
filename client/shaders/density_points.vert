#include "scene.glsl"
#include "character.glsl"
#include "strand_points.glsl"
#include "density.glsl"

// Adds the points of strands to the grids of density: each point four times, for now and at rest, in two slices.
uniform highp usampler2D placed_points;
uniform highp sampler2D rest_points;
uniform highp sampler2D rest_arcs;
uniform int target_rows;

flat out vec2 centre;  // px
flat out vec4 amount;

void main() {
  int row = first_record + gl_InstanceID / 4;
  bool is_rest = (gl_InstanceID & 1) == 1;
  int upper = (gl_InstanceID >> 1) & 1;
  gl_Position = kNowhere;
  gl_PointSize = 3.0;
  centre = vec2(0.0);
  amount = vec4(0.0);
  DensityGrid grid = density_grid(row);
  ivec2 rows = point_rows(row), at = texel_of(gl_VertexID, 0);
  if (grid.number < 0 || at.y >= rows.y || gl_VertexID == 0) return;
  // Of the segment before the point; a root has none.
  float length_m = texelFetch(rest_arcs, at, 0).x - texelFetch(rest_arcs, texel_of(gl_VertexID - 1, 0), 0).x;
  vec3 head = is_rest ? texelFetch(rest_points, at, 0).xyz
                      : position_of(texelFetch(placed_points, texel_of(gl_VertexID, rows.x), 0));
  vec3 cell = (head - grid.origin) / grid.cell - 0.5;  // the middle of the first cell is 0
  float side = float(kDensitySide), slice = floor(cell.z) + float(upper), share = 1.0 - abs(cell.z - slice);
  if (length_m <= 0.0 || share <= 0.0 || any(lessThan(cell, vec3(0.0))) || any(greaterThan(cell, vec3(side - 1.0)))) return;
  centre = vec2(cell.x + slice * side, cell.y + float(grid.number) * side) + 0.5;
  amount = grid.weight * length_m * share * (is_rest ? vec4(0.0, 1.0, 0.0, 0.0) : vec4(1.0, 0.0, 0.0, 0.0));
  gl_Position = vec4(2.0 * centre / vec2(side * side, float(target_rows)) - 1.0, 0.0, 1.0);
}
