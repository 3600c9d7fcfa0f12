#include "core/solver/calm_release.hpp"

#include <algorithm>
#include <cmath>

namespace hairnet {
namespace {

constexpr double kCalmTurn_rad = 0.17, kCalmShift_m = 0.02;
constexpr double kContactAfter_s = 1, kContactWithin_s = 1.5;
constexpr double kSpringsAfter_s = 3, kSpringsWithin_s = 4, kStiffnessLeft = 0.01;

// Hair hangs as it was designed up to the first tilt; from the second on contacts must hold it.
constexpr double kUprightTilt_rad = 0.017, kTilted_rad = 0.087;

double uprightness(const Pose& pose) {
  const double tilt_rad = std::acos(std::clamp(pose.head().vector(Vec3::UnitY()).y(), -1.0, 1.0));
  const double t = std::clamp((kTilted_rad - tilt_rad) / (kTilted_rad - kUprightTilt_rad), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

// No bone is turned or shifted much against the head.
bool is_calm(const Pose& pose) {
  static const double kTurnCosine = std::cos(kCalmTurn_rad / 2);
  for (const RigidTransform& bone : pose.bones) {
    if (std::abs(bone.rotation.dot(pose.head().rotation)) < kTurnCosine) return false;
    // The bone's origin at rest is the head joint's.
    if ((bone.position - pose.head().position).squaredNorm() > kCalmShift_m * kCalmShift_m) return false;
  }
  return true;
}

}  // namespace

double CalmRelease::update(const Pose& pose, double elapsed_s) {
  calm_s_ = is_calm(pose) ? std::min(calm_s_ + elapsed_s, kSpringsWithin_s) : 0;
  const double upright = calm_s_ > kContactAfter_s ? uprightness(pose) : 0;
  const auto come = [this](double from_s, double to_s) {
    return std::clamp((calm_s_ - from_s) / (to_s - from_s), 0.0, 1.0);
  };
  stiffness_ = 1 - (1 - kStiffnessLeft) * upright * come(kSpringsAfter_s, kSpringsWithin_s);
  return upright * come(kContactAfter_s, kContactWithin_s);
}

}  // namespace hairnet
