// The density of a character's hair as it is now and as it is at rest, in a grid of kDensitySide cells an axis that
// contains both, in head space. The slices of a grid (z) lie side by side in a texture, the grids below each other.
// From it follows how the light that reaches a place has changed since the resting hair, for which it was traced.
const int kDensitySide = 32;
const int kDensityTexel = 20;  // of a record

// Optical depth from each cell towards the key, fill and rim light and upwards.
uniform highp sampler2D light_depth_now;
uniform highp sampler2D light_depth_rest;

struct DensityGrid {
  vec3 origin;   // m
  vec3 cell;     // m
  float weight;  // optical depth in a metre of a cell that contains a metre of strand
  int number;    // -1: the character has none
};

DensityGrid density_grid(int row) {
  vec4 place = record(row, kDensityTexel);
  vec3 cell = vec3(record(row, 9).w, record(row, 11).w, record(row, 13).w);
  return DensityGrid(place.xyz, cell, record(row, 15).w, int(place.w) - 1);
}

// `at`: in cells from the grid's corner. Beside the grid its values fade out.
vec4 sample_grid(sampler2D grids, int number, vec3 at) {
  float side = float(kDensitySide);
  vec3 beside = abs(at - clamp(at, 0.0, side));
  float share = clamp(1.0 - 0.2 * max(beside.x, max(beside.y, beside.z)), 0.0, 1.0);
  at = clamp(at, 0.5, side - 0.5);
  float slice = min(floor(at.z - 0.5), side - 2.0);
  vec2 size = vec2(textureSize(grids, 0)), low = vec2(at.x + slice * side, at.y + float(number) * side);
  return share *
         mix(textureLod(grids, low / size, 0.0), textureLod(grids, (low + vec2(side, 0.0)) / size, 0.0), at.z - 0.5 - slice);
}

// The factors of light from the key, fill and rim light and of ambient light, for a point that is at `rest` in the
// resting hair and now at `now`, head space.
vec4 light_change(int row, vec3 rest, vec3 now) {
  DensityGrid grid = density_grid(row);
  if (grid.number < 0) return vec4(1.0);
  vec4 more = sample_grid(light_depth_now, grid.number, (now - grid.origin) / grid.cell) -
              sample_grid(light_depth_rest, grid.number, (rest - grid.origin) / grid.cell);
  more.w = 0.5 * more.w + dot(more.xyz, vec3(1.0 / 6.0));
  return exp(-clamp(more, -2.5, 2.5));
}
