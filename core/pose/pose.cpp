#include "core/pose/pose.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/assert.hpp"
#include "core/geometry/rounded_to_float.hpp"

namespace hairnet {
namespace {

// No head on a neck reaches this speed: a faster head rides in a vehicle or jumps.
constexpr double kTeleportSpeed_m_per_s = 25;
// On a ride the velocity may also change by this share of the speed before. A head at 300 m/s on a circle of 50 m
// changes by 0.2 of it in a tick.
constexpr double kTeleportChange = 0.25;
// A head that is faster than this jumps, as no vehicle is.
constexpr double kRideSpeedMax_m_per_s = 1000;
// A head that turns faster than this jumps.
constexpr double kTeleportTurn_deg_per_s = 2500;
// By how much the length of a valid rotation may differ from 1.
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
  constexpr double kMin = (1 - kUnitTolerance) * (1 - kUnitTolerance);
  constexpr double kMax = (1 + kUnitTolerance) * (1 + kUnitTolerance);
  return std::ranges::all_of(pose.bones, [](const RigidTransform& bone) {
    const double square = bone.rotation.squaredNorm();
    // The result is false for NaN.
    return square >= kMin && square <= kMax && bone.position.allFinite();
  });
}

Pose rounded_to_wire(const Pose& pose) {
  Pose out;
  for (std::size_t i = 0; i < kBoneCount; ++i) {
    out.bones[i].rotation.coeffs() = pose.bones[i].rotation.coeffs().unaryExpr(&rounded_to_float);
    out.bones[i].position = pose.bones[i].position.unaryExpr(&rounded_to_float);
  }
  return out;
}

Vec3 head_velocity(const Pose& from, const Pose& to, double interval_s) {
  HAIRNET_ASSERT(interval_s > 0);
  return (to.head().position - from.head().position) / interval_s;
}

bool is_teleport(const Pose& from, const Pose& to, double interval_s, const Vec3& velocity_before) {
  const Vec3 velocity = head_velocity(from, to, interval_s);
  const double speed = velocity.norm(), change_max = kTeleportSpeed_m_per_s + kTeleportChange * velocity_before.norm();
  if (speed > kRideSpeedMax_m_per_s) return true;
  if (speed > kTeleportSpeed_m_per_s && (velocity - velocity_before).norm() > change_max) return true;
  const RigidTransform &a = from.head(), &b = to.head();
  const double half_turn_deg = 0.5 * kTeleportTurn_deg_per_s * interval_s;
  // A turn beyond a half turn is a shorter one the other way.
  if (half_turn_deg >= 90) return false;
  // Squares compare without a square root, and take q and -q as one rotation. The norms are those of the wire, which
  // need not be exactly 1.
  const double cosine = std::cos(half_turn_deg * std::numbers::pi / 180), dot = a.rotation.dot(b.rotation);
  return dot * dot < cosine * cosine * a.rotation.squaredNorm() * b.rotation.squaredNorm();
}

Vec3 velocity_to_expect(const Pose& from, const Pose& to, double interval_s, const Vec3& velocity_before) {
  const Vec3 velocity = head_velocity(from, to, interval_s);
  // A jump across the room would otherwise be taken for a ride by the next comparison.
  return velocity.norm() > kRideSpeedMax_m_per_s ? velocity_before : velocity;
}

}  // namespace hairnet
