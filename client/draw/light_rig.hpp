#pragma once

#include <array>

#include "client/draw/camera.hpp"

namespace hairnet::draw {

// Distant key, fill and rim lights, and ambient light. Linear RGB.
struct LightRig {
  std::array<Vec3f, 3> towards;  // unit vectors, world
  std::array<Vec3f, 3> colours;
  Vec3f ambient_above, ambient_below;
};

// The studio turns with the camera's bearing, so that front, side and back have the same light.
LightRig studio_lights(const Camera& camera);
// `towards_camera`: of any length.
LightRig studio_lights(const Vec3& towards_camera, const Vec3& up);

}  // namespace hairnet::draw
