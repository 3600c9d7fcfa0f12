#include "client/assets/made/rig.hpp"

#include "client/assets/made/made.hpp"

namespace hairnet::made {
namespace {

constexpr double kHeadHeight_m = 1.55;
// The neck takes this share of the head's rotation relative to the trunk.
constexpr double kNeckShare = 0.4;

Quat turn(double yaw, double pitch, double roll) {
  return Quat(Eigen::AngleAxisd(yaw, Vec3::UnitY()) * Eigen::AngleAxisd(pitch, Vec3::UnitX()) *
              Eigen::AngleAxisd(roll, Vec3::UnitZ()));
}

RigidTransform about(const Vec3& joint, const Quat& rotation) {
  return {rotation, joint - rotation * joint};
}

}  // namespace

Pose pose_of(const Gesture& g, double ease, double travelled_m) {
  static const auto joints = make_bust().joints;
  const auto joint = [](Bone bone) -> Vec3 { return joints[static_cast<std::size_t>(bone)].cast<double>(); };
  const Quat facing = turn(g.facing, 0, 0);
  const Vec3 offset(ease * g.sway_m, kHeadHeight_m + ease * g.lift_m, travelled_m);
  const RigidTransform whole{facing, g.place + facing * offset};
  const auto share = [&](double part) {
    return turn(ease * part * g.head_yaw, ease * part * g.head_pitch, ease * part * g.head_roll);
  };
  Pose pose;
  pose[Bone::upper_trunk] =
      whole * about(joint(Bone::upper_trunk), turn(ease * g.trunk_yaw, ease * g.trunk_pitch, ease * g.trunk_roll));
  pose[Bone::neck] = pose[Bone::upper_trunk] * about(joint(Bone::neck), share(kNeckShare));
  pose[Bone::head] = pose[Bone::neck] * about(joint(Bone::head), share(1 - kNeckShare));
  pose[Bone::left_shoulder] = pose[Bone::upper_trunk] * about(joint(Bone::left_shoulder),
                                                              turn(-ease * g.left_shoulder, 0, ease * g.shoulders_up));
  pose[Bone::right_shoulder] =
      pose[Bone::upper_trunk] *
      about(joint(Bone::right_shoulder), turn(ease * g.right_shoulder, 0, -ease * g.shoulders_up));
  return pose;
}

}  // namespace hairnet::made
