#include "client/assets/made/rig.hpp"

#include "client/assets/made/made.hpp"

namespace hairnet::made {
namespace {

// The height of the head joint above the floor at rest, as made.hpp promises for make_motion().
constexpr double kHeadHeight_m = 1.55;
// The neck takes this share of the head's rotation relative to the trunk.
constexpr double kNeckShare = 0.4;

// Yaw about the upright axis is applied last, so a turned person still nods forward.
Quat turn(double yaw, double pitch, double roll) {
  return Quat(Eigen::AngleAxisd(yaw, Vec3::UnitY()) * Eigen::AngleAxisd(pitch, Vec3::UnitX()) *
              Eigen::AngleAxisd(roll, Vec3::UnitZ()));
}

// A rotation about a point of head space at rest.
RigidTransform about(const Vec3& joint, const Quat& rotation) {
  return {rotation, joint - rotation * joint};
}

}  // namespace

Pose pose_of(const Gesture& g, double ease, double travelled_m) {
  // The bust is made once, since only its joints are needed; the initialisation is safe for threads.
  static const auto joints = make_bust().joints;
  const auto joint = [](Bone bone) -> Vec3 { return joints[static_cast<std::size_t>(bone)].cast<double>(); };
  // Where the person stands does not depend on `ease`: a teleport is a jump by design.
  const Quat facing = turn(g.facing, 0, 0);
  const Vec3 offset(ease * g.sway_m, kHeadHeight_m + ease * g.lift_m, travelled_m);
  const RigidTransform whole{facing, g.place + facing * offset};
  // The same rotation is shared by two joints as angles, which is close to a half rotation for the small angles of a
  // neck.
  const auto share = [&](double part) {
    return turn(ease * part * g.head_yaw, ease * part * g.head_pitch, ease * part * g.head_roll);
  };
  Pose pose;
  // Each bone is a transform of head space at rest to the world, so a child's own turn is applied before its parent's.
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
