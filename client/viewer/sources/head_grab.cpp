#include "client/viewer/sources/head_grab.hpp"

#include <algorithm>
#include <cmath>

#include "core/pose/complete_pose.hpp"

namespace hairnet::viewer {
namespace {

// The rates of the critical damping. A grabbed head makes half of a step in about 40 ms, so it seems fixed to the
// mouse. A free one returns in about half a second.
constexpr double kGrabbedRate_per_s = 45, kFreeRate_per_s = 9;
// Offsets (rad, m) and speeds (the same a second) below this are not seen.
constexpr double kAtRest = 1e-5;

Quat from_rotation_vector(const Vec3& v) {
  // Returns the identity for a vector too short to have an axis.
  const double angle = v.norm();
  return angle > 1e-12 ? Quat(Eigen::AngleAxisd(angle, v / angle)) : Quat::Identity();
}

Vec3 to_rotation_vector(const Quat& q) {
  // The sign of q is free; this one gives the turn of at most half a circle.
  const Eigen::AngleAxisd turn(q.w() < 0 ? Quat(-q.coeffs()) : q);
  return turn.angle() * turn.axis();
}

Vec3 limited(const Vec3& v, double most) {
  const double length = v.norm();
  return length > most ? Vec3(v * (most / length)) : v;
}

}  // namespace

// Solves the equation of critical damping exactly for a constant target, so that pictures of any length give the same
// path and nothing overshoots.
void HeadGrab::DampedValue::advance(double elapsed_s, double rate_per_s, double speed_max) {
  const Vec3 error = at - target, c = speed + rate_per_s * error;
  const double decay = std::exp(-rate_per_s * elapsed_s);
  const Vec3 step = decay * (error + elapsed_s * c) - error;
  // A mouse may jump across the screen between two pictures. The value follows at its greatest speed instead: a faster
  // head would count as a teleport, and its hair would not swing.
  const Vec3 slow = limited(step, speed_max * elapsed_s);
  at += slow;
  speed = slow.squaredNorm() < step.squaredNorm() ? Vec3(slow / elapsed_s)
                                                  : limited(decay * (speed - rate_per_s * elapsed_s * c), speed_max);
}

void HeadGrab::take() {
  // The grab begins where the head is, also in the middle of its way back.
  grabbed_ = true;
  turn_.target = turn_.at;
  shift_.target = shift_.at;
}

void HeadGrab::turn(const Vec3& axis_world, double angle_rad) {
  if (!grabbed_) return;
  const Quat more(Eigen::AngleAxisd(angle_rad, axis_world));
  // The turn so far comes first, then the new one: axes are the world's, as the user sees them.
  turn_.target = limited(to_rotation_vector(more * from_rotation_vector(turn_.target)), kTurnMax_rad);
}

void HeadGrab::move(const Vec3& by_world_m) {
  if (grabbed_) shift_.target = limited(shift_.target + by_world_m, kShiftMax_m);
}

void HeadGrab::release() {
  grabbed_ = false;
  turn_.target.setZero();
  shift_.target.setZero();
}

void HeadGrab::advance(double elapsed_s) {
  if (!(elapsed_s > 0)) return;
  const double rate_per_s = grabbed_ ? kGrabbedRate_per_s : kFreeRate_per_s;
  turn_.advance(elapsed_s, rate_per_s, kTurnSpeedMax_rad_per_s);
  shift_.advance(elapsed_s, rate_per_s, kShiftSpeedMax_m_per_s);
  if (grabbed_ || !at_rest()) return;
  // Exactly zero, so that apply() leaves poses as they are, to the bit.
  turn_ = {};
  shift_ = {};
}

bool HeadGrab::at_rest() const {
  const double furthest = std::max({turn_.at.norm(), turn_.speed.norm(), shift_.at.norm(), shift_.speed.norm()});
  return !grabbed_ && furthest < kAtRest;
}

Pose HeadGrab::apply(const Pose& pose, const Body& body) const {
  if (at_rest()) return pose;
  Pose out = pose;
  const Vec3 neck_joint = body.joints[static_cast<std::size_t>(Bone::neck)].cast<double>();
  RigidTransform& head = out[Bone::head];
  head.rotation = (from_rotation_vector(turn_.at) * head.rotation).normalized();
  // The foot of the neck stays where the motion has it.
  head.position = pose.head().point(neck_joint) - head.rotation * neck_joint;
  // The neck gets what the rule for missing bones (PoseCompletion) adds to it for this turn, on top of the motion.
  const PoseCompletion completion(body.joint(Bone::neck));
  const Quat& trunk = pose[Bone::upper_trunk].rotation;
  out[Bone::neck] = completion.neck(head, trunk) * completion.neck(pose.head(), trunk).inverse() * pose[Bone::neck];
  // All bones move together, so that the neck does not stretch.
  for (RigidTransform& bone : out.bones) bone.position += shift_.at;
  return out;
}

}  // namespace hairnet::viewer
