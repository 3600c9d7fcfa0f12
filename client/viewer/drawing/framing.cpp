#include "client/viewer/drawing/framing.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "client/assets/upright.hpp"

namespace hairnet::viewer {
namespace {

// Head and shoulders extend this far about the head joint, also of short hair.
constexpr double kUpwards_m = 0.22, kAround_m = 0.24;

// How far hair hangs below the head joint at rest.
double hang_m(const Groom& groom) {
  // The search begins at the neck, 20 cm below the joint, which is shown in any case.
  float low = -0.2f;
  for (const Vec3f& p : groom.points) low = std::min(low, p.y());
  return -static_cast<double>(low);
}

}  // namespace

Vec3 head_middle(const Pose& pose) {
  // The middle of a face lies above its joint, and a little in front.
  return pose.head().point(Vec3(0, 0.08, 0.01));
}

Vec3 direction_of(View view) {
  switch (view) {
    case View::front:
      // Directions from the head to the eye, which need not have unit length; the height shows a head slightly from
      // above.
      return {0, 0.05, 1};
    case View::side:
      return {1, 0.05, 0};
    case View::back:
      return {0, 0.05, -1};
    case View::three_quarter:
      return {0.64, 0.12, 0.77};
  }
  return Vec3::UnitZ();
}

std::optional<Vec3> middle_of(std::span<const ViewedCharacter> viewed) {
  if (viewed.empty()) return {};
  Vec3 sum = Vec3::Zero();
  for (const ViewedCharacter& character : viewed) sum += head_middle(character.pose);
  return Vec3(sum / static_cast<double>(viewed.size()));
}

void frame_all(std::span<const ViewedCharacter> viewed, View view, int width, int height, OrbitCamera& camera) {
  if (viewed.empty()) return;
  Vec3 facing = Vec3::Zero();
  // Characters with one groom mostly follow each other, so this saves most of the searches.
  const Groom* groom = nullptr;
  double hang = 0;
  for (const ViewedCharacter& character : viewed) {
    facing += upright(character.pose).head().vector(Vec3::UnitZ());
    if (std::exchange(groom, character.groom.get()) != character.groom.get())
      hang = std::max(hang, hang_m(*character.groom));
  }
  // Faces in opposite directions have no mean direction: then the world's front is shown.
  const double heading = facing.norm() > 1e-3 ? std::atan2(facing.x(), facing.z()) : 0;
  const Quat turn(Eigen::AngleAxisd(heading, Vec3::UnitY()));
  camera.look_from((turn * direction_of(view)).normalized());
  // The smallest upright rectangle across the view that contains everything, then the extra depth of the nearest parts
  // towards the eye, which perspective enlarges.
  Eigen::AlignedBox3d box;
  const Vec3 backward = (camera.camera().eye - camera.camera().target).normalized();
  for (const ViewedCharacter& character : viewed) {
    const Vec3& joint = character.pose.head().position;
    const auto in_view = [&](const Vec3& p) {
      return Vec3(p.dot(camera.right()), p.dot(camera.up()), p.dot(backward));
    };
    box.extend(in_view(joint + Vec3(0, kUpwards_m, 0)));
    box.extend(in_view(joint - Vec3(0, hang, 0)));
    box.extend(in_view(joint + kAround_m * camera.right()));
    box.extend(in_view(joint - kAround_m * camera.right()));
  }
  const double aspect = static_cast<double>(width) / std::max(1, height);
  const Vec3 half = 0.5 * box.diagonal(), centre = box.center();
  // The width counts by the picture's shape: a wide picture shows more at its sides. 57.3 degrees make a radian.
  const double radius = std::max(half.y(), half.x() / aspect) + half.z() * std::tan(0.5 * OrbitCamera::kFov_deg / 57.3);
  camera.frame(centre.x() * camera.right() + centre.y() * camera.up() + centre.z() * backward, radius);
}

}  // namespace hairnet::viewer
