#include "scene.glsl"
#include "character.glsl"
#include "density.glsl"

// Covers the grid of a character; each instance is a character. Six vertices, no vertex data.
uniform int target_rows;
flat out int row;

void main() {
  row = first_record + gl_InstanceID;
  int corner = gl_VertexID < 3 ? gl_VertexID : gl_VertexID - 2, number = density_grid(row).number;
  float y = float((number + (corner >> 1)) * kDensitySide) / float(target_rows);
  gl_Position = number < 0 ? kNowhere : vec4(2.0 * float(corner & 1) - 1.0, 2.0 * y - 1.0, 0.0, 1.0);
}
