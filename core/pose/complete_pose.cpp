#include "core/pose/complete_pose.hpp"

#include <cmath>
#include <numbers>

namespace hairnet {
namespace {

constexpr double kNeckShare = 0.5;
constexpr double kTwistMin = 1e-6;  // below, the head hangs upside down and faces nowhere

}  // namespace

PoseCompletion::PoseCompletion(const Body& body, double yaw_lag_s)
    : neck_joint_(body.joints[static_cast<std::size_t>(Bone::neck)].cast<double>()), yaw_lag_s_(yaw_lag_s) {}

Pose PoseCompletion::complete(const RigidTransform& head, double elapsed_s) {
  // Yaw is the twist about +Y of the head's rotation (swing-twist); where there is none the trunk keeps its own.
  const Quat& q = head.rotation;
  if (q.w() * q.w() + q.y() * q.y() > kTwistMin) {
    const double behind = std::remainder(2 * std::atan2(q.y(), q.w()) - trunk_yaw_, 2 * std::numbers::pi);
    const bool follows = started_ && elapsed_s > 0 && yaw_lag_s_ > 0;
    trunk_yaw_ += follows ? -std::expm1(-elapsed_s / yaw_lag_s_) * behind : behind;
  }
  started_ = true;

  Pose pose;
  pose[Bone::head] = head;
  const Quat trunk(Eigen::AngleAxisd(trunk_yaw_, Vec3::UnitY()));
  RigidTransform& neck = pose[Bone::neck];
  neck = {trunk.slerp(kNeckShare, head.rotation).normalized(), head.position};  // joined at the head joint, the origin
  pose[Bone::upper_trunk] = {trunk, neck.point(neck_joint_) - trunk * neck_joint_};
  pose[Bone::left_shoulder] = pose[Bone::right_shoulder] = pose[Bone::upper_trunk];
  return pose;
}

}  // namespace hairnet
