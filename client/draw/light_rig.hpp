#pragma once

#include <array>

#include "client/draw/camera.hpp"

namespace hairnet::draw {

// Distant key, fill and rim lights, and ambient light from above and below. Linear RGB; hair and skin are lit by the
// same rig.
struct LightRig {
  // Unit vectors from the scene to the lights, world.
  std::array<Vec3f, 3> towards;
  std::array<Vec3f, 3> colours;
  Vec3f ambient_above, ambient_below;
};

// The studio turns with the camera's bearing, so that front, side and back have the same light, and pictures of
// hairstyles can be compared.
LightRig studio_lights(const Camera& camera);
// `towards_camera` has any length; only its bearing about `up` counts, so that the light does not tilt with the camera.
LightRig studio_lights(const Vec3& towards_camera, const Vec3& up);

}  // namespace hairnet::draw
