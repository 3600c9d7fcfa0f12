#pragma once

#include "core/geometry/vec.hpp"

namespace hairnet::view {

// World space, m.
struct Camera {
  Vec3 eye{0, 0, 1}, target{0, 0, 0}, up{0, 1, 0};
  float fov_deg = 30;  // vertical
};

}  // namespace hairnet::view
