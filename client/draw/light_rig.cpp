#include "client/draw/light_rig.hpp"

#include <cmath>
#include <numbers>

namespace hairnet::draw {
namespace {

// The key, the fill and the rim light. The first list has their bearing and their height in degrees, the second their
// linear RGB. The key is warm and comes from the camera's left, the fill is weak and cool from its right, and the rim
// light from behind outlines the hair.
constexpr std::array<std::array<float, 2>, 3> kBearingHeight_deg{{{-42, 42}, {55, 12}, {152, 38}}};
constexpr std::array<std::array<float, 3>, 3> kColours{
    {{1.02f, 0.98f, 0.92f}, {0.24f, 0.26f, 0.29f}, {0.80f, 0.84f, 0.92f}}};
// The light from above and from below, linear RGB, which reaches every place that hair does not cover.
constexpr std::array<float, 3> kAmbientAbove{0.22f, 0.23f, 0.25f}, kAmbientBelow{0.13f, 0.12f, 0.115f};

// Bearing 0 is the direction to the camera, positive to its right.
Vec3f direction(const Vec3f& to_camera, const Vec3f& up, float bearing_deg, float height_deg) {
  const Vec3f right = up.cross(to_camera);
  const float bearing = bearing_deg * std::numbers::pi_v<float> / 180.0f;
  const float height = height_deg * std::numbers::pi_v<float> / 180.0f;
  return std::cos(height) * (std::cos(bearing) * to_camera + std::sin(bearing) * right) + std::sin(height) * up;
}

}  // namespace

LightRig studio_lights(const Camera& camera) {
  return studio_lights(camera.eye - camera.target, camera.up);
}

LightRig studio_lights(const Vec3& towards_camera, const Vec3& above) {
  const Vec3f up = above.normalized().cast<float>();
  Vec3f level = towards_camera.cast<float>();
  level -= up * up.dot(level);
  // A camera that looks straight up or down has no bearing: any level direction will do.
  if (!(level.norm() > 1e-3 * towards_camera.norm())) level = up.unitOrthogonal();
  const Vec3f to_camera = level.normalized();
  LightRig rig;
  for (std::size_t i = 0; i < rig.towards.size(); ++i) {
    rig.towards[i] = direction(to_camera, up, kBearingHeight_deg[i][0], kBearingHeight_deg[i][1]);
    rig.colours[i] = Vec3f(kColours[i].data());
  }
  rig.ambient_above = Vec3f(kAmbientAbove.data());
  rig.ambient_below = Vec3f(kAmbientBelow.data());
  return rig;
}

}  // namespace hairnet::draw
