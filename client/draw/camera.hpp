#pragma once

#include "core/geometry/vec.hpp"

namespace hairnet::draw {

// World space, m.
struct Camera {
  Vec3 eye{0, 0, 1}, target{0, 0, 0}, up{0, 1, 0};
  float fov_deg = 30;  // vertical
};

// The depths of a picture, along the view, m.
struct DepthRange {
  float near_m = 0.1f, far_m = 100;
};

}  // namespace hairnet::draw
