#pragma once

#include <span>
#include <vector>

#include "core/levels/grid.hpp"

namespace hairnet {

// A strand of a smaller length, m, has no mechanics, and shorter distances between points count as none.
inline constexpr double kLengthMin = 1e-5;  // m

// A strand's polyline in grid coordinates, without repeated points.
void polyline_on_grid(const Grid& grid, std::span<const Vec3f> points_head, std::vector<Vec3>& polyline);

// The length of the polyline, m.
double arc_length(const Grid& grid, std::span<const Vec3> polyline);

// A tenth of the smallest spacing, m. Shorter pieces between cut points are merged into a neighbour, since k grows as 1
// / L.
double piece_length_min(const Grid& grid);

// The points where a strand is cut into springs (paper 3.1), in grid coordinates; root and tip are the first and last.
// Each segment is cut at the lattice planes of the axis along which it is longest. These cuts include every crossing at
// more than 45 degrees; a body diagonal, which crosses all planes at 35 degrees, is cut as well. A cut point has an
// exact whole number on its axis, so that only four nodes have a weight there. Asserts that `polyline` has two points
// or more.
void cut_points(const Grid& grid, std::span<const Vec3> polyline, std::vector<Vec3>& cuts);

}  // namespace hairnet
