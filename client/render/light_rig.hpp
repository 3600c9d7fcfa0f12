#pragma once

#include <array>

#include "client/render/camera.hpp"

namespace hairnet::render {

// Key, fill and rim from far away, and the room's own light. Linear RGB.
struct LightRig {
  std::array<Vec3f, 3> towards;  // unit vectors, world
  std::array<Vec3f, 3> colours;
  Vec3f ambient_above, ambient_below;
};

// The studio stands about the camera's bearing, so that front, side and back are lit alike.
LightRig studio_lights(const Camera& camera);

}  // namespace hairnet::render
