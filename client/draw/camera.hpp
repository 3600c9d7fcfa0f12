#pragma once

#include "core/geometry/vec.hpp"

namespace hairnet::draw {

// A pinhole camera. World space, m, in doubles, so that a scene may lie far from the world's origin. Some values cannot
// be drawn with, such as an eye at its target: the renderer repairs them (render::sanitized).
struct Camera {
  Vec3 eye{0, 0, 1}, target{0, 0, 0}, up{0, 1, 0};
  // The vertical field of view.
  float fov_deg = 30;
};

// The near and far planes of a picture: distances from the eye along the view, m. Code that draws over a picture needs
// the same ones, since depths in between are not linear.
struct DepthRange {
  float near_m = 0.1f, far_m = 100;
};

}  // namespace hairnet::draw
