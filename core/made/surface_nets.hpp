#pragma once

#include <array>
#include <functional>
#include <vector>

#include "core/geometry/triangle_mesh.hpp"

namespace hairnet::made {

// Planes of a rectilinear grid, ascending, one list an axis; the spacing may vary.
using GridPlanes = std::array<std::vector<double>, 3>;

// The zero surface of `field` (negative inside) as a closed mesh: naive surface nets, one vertex a crossed cell. The
// surface must lie within the grid, a cell away from its border.
TriangleMesh polygonise(const GridPlanes& planes, const std::function<double(const Vec3&)>& field);

}  // namespace hairnet::made
