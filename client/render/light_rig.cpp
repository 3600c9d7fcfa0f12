#include "client/render/light_rig.hpp"

#include <cmath>
#include <numbers>

namespace hairnet::render {
namespace {

// Bearing 0 is the direction to the camera, positive to its right.
Vec3f direction(const Vec3f& to_camera, const Vec3f& up, float bearing_deg, float height_deg) {
  const Vec3f right = up.cross(to_camera);
  const float bearing = bearing_deg * std::numbers::pi_v<float> / 180.0f;
  const float height = height_deg * std::numbers::pi_v<float> / 180.0f;
  return std::cos(height) * (std::cos(bearing) * to_camera + std::sin(bearing) * right) + std::sin(height) * up;
}

}  // namespace

LightRig studio_lights(const Camera& camera) {
  const Vec3f up = camera.up.normalized().cast<float>();
  Vec3f level = (camera.eye - camera.target).cast<float>();
  level -= up * up.dot(level);
  if (level.norm() < 1e-3f * (camera.eye - camera.target).norm()) level = up.unitOrthogonal();
  const Vec3f to_camera = level.normalized();
  LightRig rig;
  rig.towards = {direction(to_camera, up, -42, 42), direction(to_camera, up, 55, 12),
                 direction(to_camera, up, 152, 38)};
  rig.colours = {Vec3f(1.02f, 0.98f, 0.92f), Vec3f(0.24f, 0.26f, 0.29f), Vec3f(0.80f, 0.84f, 0.92f)};
  rig.ambient_above = Vec3f(0.22f, 0.23f, 0.25f);
  rig.ambient_below = Vec3f(0.13f, 0.12f, 0.115f);
  return rig;
}

}  // namespace hairnet::render
