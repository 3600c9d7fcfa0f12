#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/geometry/vec.hpp"

namespace hairnet {

// Triangles wound counter-clockwise seen from outside, as indices of vertices. Nothing here checks the indices:
// validate(Groom) does for bodies from outside.
struct TriangleMesh {
  std::vector<Vec3f> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

}  // namespace hairnet
