#include "scene.glsl"
#include "character.glsl"

// Covers the rows of `lattices` with the nodes of a character; each instance is a character. Six vertices, no vertex
// data. Leaves out characters whose nodes do not come from the source of this draw call.
uniform int target_rows;
uniform int basis;  // its number in the picture; 0: nodes are uploaded
flat out int row;
flat out int first_row;

void main() {
  row = first_record + gl_InstanceID;
  first_row = int(record(row, kLatticeTexel + 1).w) / kLatticeRow;
  gl_Position = kNowhere;
  if (record(row, 4).z < 0.5 || int(record(row, kLatticeTexel).w) != basis) return;
  int corner = gl_VertexID < 3 ? gl_VertexID : gl_VertexID - 2;
  float y = float(first_row + (corner >> 1) * node_rows(row)) / float(target_rows);
  gl_Position = vec4(2.0 * float(corner & 1) - 1.0, 2.0 * y - 1.0, 0.0, 1.0);
}
