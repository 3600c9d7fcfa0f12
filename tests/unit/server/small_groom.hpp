#pragma once

#include <cmath>

#include "core/groom/groom.hpp"

namespace hairnet::server {

// A few straight strands on an octahedron as skull: the least hair from which levels can be built. `seed` makes grooms
// differ.
inline Groom small_groom(unsigned seed = 1) {
  Groom groom;
  groom.name = "small " + std::to_string(seed);
  groom.group_names = {"all"};
  const float r = 0.09f;
  groom.body.mesh.vertices = {{r, 0, 0}, {-r, 0, 0}, {0, r, 0}, {0, -r, 0}, {0, 0, r}, {0, 0, -r}};
  groom.body.mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  groom.body.bone_weights.assign(groom.body.mesh.vertices.size(), {1, 0, 0, 0, 0});
  for (int s = 0; s < 24; ++s) {
    const float a = 0.26f * static_cast<float>(s) + 0.01f * static_cast<float>(seed);
    const Vec3f root = r * Vec3f(std::cos(a), 0, std::sin(a));
    std::vector<Vec3f> strand;
    for (int i = 0; i < 8; ++i)
      strand.push_back(root * (1 + 0.02f * static_cast<float>(i)) - Vec3f(0, 0.025f * static_cast<float>(i), 0));
    groom.add_strand(strand, {});
  }
  return groom;
}

}  // namespace hairnet::server
