#include "core/pose/complete_pose.hpp"

#include <cmath>
#include <numbers>

#include "core/assert.hpp"
#include "core/smoothstep.hpp"

namespace hairnet {
namespace {

constexpr double kPi = std::numbers::pi;

struct Yaw {
  // The yaw about +Y, in (-pi, pi], rad.
  double angle;
  // How far the yaw is to be trusted: 1 for a head tilted by up to 120 degrees, falling to 0 upside down.
  double trust;
};

// Swing-twist: rotation = swing * twist with the twist about +Y and the swing's axis horizontal.
Yaw yaw_of(const Quat& rotation) {
  // The squared cosine of half the swing.
  const double twist_squared = rotation.w() * rotation.w() + rotation.y() * rotation.y();
  const double angle = std::remainder(2 * std::atan2(rotation.y(), rotation.w()), 2 * kPi);
  // The factor 4 makes the trust 1 up to a swing of 120 degrees, where the squared cosine is 1/4.
  return {angle, smoothstep(0.0, 1.0, 4 * twist_squared)};
}

// A transform with `rotation` that maps the joint to the same place as `from` does.
RigidTransform about_joint(const Quat& rotation, const RigidTransform& from, const Vec3& joint) {
  return {rotation, from.point(joint) - rotation * joint};
}

// Half of the head's rotation relative to the trunk; less at angles that no neck can bend.
Quat neck_rotation(const Quat& trunk, const Quat& head) {
  // The angle of the result is in [0, pi].
  const Eigen::AngleAxisd bend(trunk.conjugate() * head);
  // Up to 120 degrees the neck takes half of the turn; beyond, its part falls to zero at 180 degrees, which no neck can
  // bend.
  constexpr double kFullBend = 2 * kPi / 3;
  const double share = bend.angle() <= kFullBend ? 0.5 * bend.angle() : kPi - bend.angle();
  return (trunk * Quat(Eigen::AngleAxisd(share, bend.axis()))).normalized();
}

}  // namespace

PoseCompletion::PoseCompletion(const Vec3& neck_joint_head, double yaw_lag_s)
    : neck_joint_(neck_joint_head), yaw_lag_s_(yaw_lag_s) {
  HAIRNET_ASSERT(neck_joint_head.allFinite());
  HAIRNET_ASSERT(yaw_lag_s >= 0);
}

Pose PoseCompletion::complete(const RigidTransform& head, double elapsed_s) {
  const Yaw yaw = yaw_of(head.rotation);
  if (!started_ || !(elapsed_s > 0)) {
    trunk_yaw_ = yaw.angle;
    started_ = true;
  } else {
    // The lag is of first order, so the result does not depend on how often complete() is called.
    const double share = yaw_lag_s_ > 0 ? 1 - std::exp(-elapsed_s / yaw_lag_s_) : 1;
    // The trunk turns the shorter way round, which may lead across the back.
    const double behind = std::remainder(yaw.angle - trunk_yaw_, 2 * kPi);
    trunk_yaw_ = std::remainder(trunk_yaw_ + share * yaw.trust * behind, 2 * kPi);
  }
  HAIRNET_ASSERT(started_);
  HAIRNET_ASSERT(!(std::abs(trunk_yaw_) > kPi + 1e-9));
  const Quat trunk(Eigen::AngleAxisd(trunk_yaw_, Vec3::UnitY()));

  Pose pose = rigid_pose(about_joint(trunk, head, neck_joint_));
  pose[Bone::head] = head;
  pose[Bone::neck] = neck(head, trunk);
  return pose;
}

RigidTransform PoseCompletion::neck(const RigidTransform& head, const Quat& trunk) const {
  return about_joint(neck_rotation(trunk, head.rotation), head, neck_joint_);
}

}  // namespace hairnet
