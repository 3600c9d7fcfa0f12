#pragma once

#include <array>
#include <functional>
#include <vector>

#include "core/geometry/triangle_mesh.hpp"

namespace hairnet::made {

// Planes of a rectilinear grid, ascending, one list an axis; the spacing may vary.
using GridPlanes = std::array<std::vector<double>, 3>;

// The zero surface of `field` (negative inside) as a closed mesh, by naive surface nets: one vertex for each cell that
// the surface crosses. This gives fewer and better shaped triangles than marching cubes. Triangles are wound outwards.
// The field is evaluated near the surface alone. So the surface must be in one piece, stay at least one cell inside the
// grid, and cross the row of the first axis that is at the middle of the other two.
TriangleMesh polygonise(const GridPlanes& planes, const std::function<double(const Vec3&)>& field);

}  // namespace hairnet::made
