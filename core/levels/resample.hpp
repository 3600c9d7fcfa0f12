#pragma once

#include <span>
#include <vector>

#include "core/levels/grid.hpp"

namespace hairnet {

// Shorter distances between points count as none, and a strand without length has no mechanics.
inline constexpr double kLengthMin = 1e-5;  // m

// A strand's polyline in grid coordinates, without repeated points.
void polyline_on_grid(const Grid& grid, std::span<const Vec3f> points_head, std::vector<Vec3>& polyline);

// The length of the polyline, m.
double arc_length(const Grid& grid, std::span<const Vec3> polyline);

// Pieces between cut points shorter than this are merged into a neighbour: k grows as 1 / L.
// Returns a tenth of the smallest spacing, m.
double piece_length_min(const Grid& grid);

// The points where a strand is cut into springs (paper 3.1), in grid coordinates; root and tip are the first and last.
// Each segment is cut at the lattice planes of the axis along which it is longest. These cuts include every crossing at
// more than 45 degrees; a body diagonal, which crosses all planes at 35 degrees, is cut as well. A cut point has an
// exact whole number on its axis, so that only four nodes have a weight there. Asserts that `polyline` has two points
// or more.
void cut_points(const Grid& grid, std::span<const Vec3> polyline, std::vector<Vec3>& cuts);

}  // namespace hairnet
