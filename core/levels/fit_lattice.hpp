#pragma once

#include <array>
#include <span>

#include "core/ffd/lattice.hpp"

namespace hairnet {

// The lattice around all points with a margin of half a cell on every side: extent + spacing = (n - 1) spacing, so that
// spacing = extent / (n - 2). An axis along which the points hardly extend gets kSpacingMin and is centred on the
// points. `dims`: nodes an axis. Every point is inside. Asserts that each axis has three nodes or more, and that the
// points are finite.
inline constexpr double kSpacingMin = 0.01;  // m
Lattice fit_lattice(std::span<const Vec3f> points_head, const std::array<int, 3>& dims);

}  // namespace hairnet
