#include "core/solver/contact.hpp"

#include <algorithm>
#include <cmath>

#include "core/solver/head_motion.hpp"
#include "core/solver/metaball.hpp"
#include "core/solver/node_terms.hpp"

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
  const RigidTransform to_head = pose.head().inverse();
  for (const RigidTransform& bone : pose.bones) {
    const RigidTransform relative = to_head * bone;
    if (relative.rotation.angularDistance(Quat::Identity()) > kCalmTurn_rad) return false;
    if (relative.position.norm() > kCalmShift_m) return false;
  }
  return true;
}

}  // namespace

double CalmRelease::update(const Pose& pose, double elapsed_s) {
  calm_s_ = is_calm(pose) ? std::min(calm_s_ + elapsed_s, kSpringsWithin_s) : 0;
  const double upright = uprightness(pose);
  const auto come = [this](double from_s, double to_s) {
    return std::clamp((calm_s_ - from_s) / (to_s - from_s), 0.0, 1.0);
  };
  stiffness_ = 1 - (1 - kStiffnessLeft) * upright * come(kSpringsAfter_s, kSpringsWithin_s);
  return upright * come(kContactAfter_s, kContactWithin_s);
}

void add_contacts(const Level& level, const StepInput& input, const LatticeState& state, std::span<const Vec3f> carried,
                  std::span<Vec3f> load, std::span<Mat3f> diagonal) {
  const auto h = static_cast<float>(input.step_s);
  const auto release = static_cast<float>(input.contact_release);
  for (const Metaball& ball : level.metaballs) {
    const RigidTransform carry = bone_carry(input, ball.bone);
    const Mat3f turn = carry.rotation.toRotationMatrix().cast<float>();
    const Vec3f shift = carry.position.cast<float>();
    const Vec3f centre = posed(input, ball.bone, ball.centre.cast<double>()).cast<float>();
    for (std::size_t i = 0; i < level.rest.size(); ++i) {
      const float rho = ball.radius[i];
      if (rho <= 0) continue;
      const Vec3f with_bone = turn * (level.rest[i] + state.displacement[i]) + shift;
      const Vec3f r = with_bone - centre;
      const float distance = r.norm();
      if (!(distance < rho) || distance <= 0) continue;
      const Vec3f outward = r / distance;
      const float U = (1 - release) * contact_potential(ball, input.material, i);
      const float k = metaball_radial_stiffness(U, rho, r);
      const Vec3f otherwise = level.rest[i] + carried[i] - with_bone;
      load[i] += metaball_force(U, rho, r) - k * outward.dot(otherwise) * outward;
      diagonal[i] += (h * h * k) * outward * outward.transpose();
    }
  }
}

}  // namespace hairnet
