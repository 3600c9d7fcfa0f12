#include "scene.glsl"
#include "character.glsl"
#include "density.glsl"

// The optical depth of the hair from a cell towards the lights.
flat in int row;
uniform highp sampler2D density;  // red: now; green: at rest
layout(location = 0) out vec4 now;
layout(location = 1) out vec4 rest;

const int kSteps = 8;

void main() {
  DensityGrid grid = density_grid(row);
  ivec2 at = ivec2(gl_FragCoord.xy) - ivec2(0, grid.number * kDensitySide);
  vec3 middle = vec3(at.x % kDensitySide, at.y, at.x / kDensitySide) + 0.5;
  vec4 rotation = record(row, 0);
  float size = 1.0 + record(row, 4).w;
  float step_m = 1.4 * dot(grid.cell, vec3(1.0 / 3.0));
  vec4 sums[2] = vec4[2](vec4(0.0), vec4(0.0));
  for (int i = 0; i < 4; ++i) {
    vec3 along = to_head_axes(rotation, size, i < 3 ? light_direction[i] : vec3(0.0, 1.0, 0.0)) * step_m / grid.cell;
    vec3 place = middle + 0.5 * along;
    vec2 sum = vec2(0.0);
    for (int n = 0; n < kSteps; ++n) {
      place += along;
      if (any(lessThan(place, vec3(0.0))) || any(greaterThan(place, vec3(kDensitySide)))) break;
      sum += sample_grid(density, grid.number, place).xy;
    }
    sums[0][i] = sum.x * step_m;
    sums[1][i] = sum.y * step_m;
  }
  now = sums[0];
  rest = sums[1];
}
