#include "core/pose/pose.hpp"

#include <cmath>
#include <numbers>

#include "core/assert.hpp"
#include "core/geometry/rounded_to_float.hpp"

namespace hairnet {
namespace {

constexpr double kTeleportSpeed_m_per_s = 25;
constexpr double kTeleportTurn_deg_per_s = 2500;
constexpr double kUnitTolerance = 1e-3;

}  // namespace

Pose rigid_pose(const RigidTransform& whole) {
  Pose pose;
  pose.bones.fill(whole);
  return pose;
}

Pose interpolate(const Pose& a, const Pose& b, double s) {
  HAIRNET_ASSERT(std::isfinite(s));
  Pose out;
  for (std::size_t i = 0; i < kBoneCount; ++i) out.bones[i] = interpolate(a.bones[i], b.bones[i], s);
  return out;
}

bool is_valid(const Pose& pose) {
  for (const RigidTransform& bone : pose.bones) {
    if (!bone.position.allFinite() || !bone.rotation.coeffs().allFinite()) return false;
    if (std::abs(bone.rotation.norm() - 1) > kUnitTolerance) return false;
  }
  return true;
}

Pose rounded_to_wire(const Pose& pose) {
  Pose out;
  for (std::size_t i = 0; i < kBoneCount; ++i) {
    out.bones[i].rotation.coeffs() = pose.bones[i].rotation.coeffs().unaryExpr(&rounded_to_float);
    out.bones[i].position = pose.bones[i].position.unaryExpr(&rounded_to_float);
  }
  return out;
}

bool is_teleport(const Pose& from, const Pose& to, double interval_s) {
  HAIRNET_ASSERT(interval_s > 0);
  const double distance_m = (to.head().position - from.head().position).norm();
  const double turn_deg = from.head().rotation.angularDistance(to.head().rotation) * 180 / std::numbers::pi;
  return distance_m > kTeleportSpeed_m_per_s * interval_s || turn_deg > kTeleportTurn_deg_per_s * interval_s;
}

}  // namespace hairnet
