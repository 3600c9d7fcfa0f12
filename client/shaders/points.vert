#include "scene.glsl"
#include "character.glsl"
#include "strand_points.glsl"

// Covers all rows of the points of a character; each instance is a character. Six vertices, no vertex data.
uniform int target_rows;
flat out int row;

void main() {
  row = first_record + gl_InstanceID;
  int corner = gl_VertexID < 3 ? gl_VertexID : gl_VertexID - 2;
  ivec2 rows = point_rows(row);
  float y = float(rows.x + (corner >> 1) * rows.y) / float(target_rows);
  gl_Position = vec4(2.0 * float(corner & 1) - 1.0, 2.0 * y - 1.0, 0.0, 1.0);
}
