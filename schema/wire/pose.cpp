#include <cmath>

#include "core/assert.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::wire {
namespace {

// The length of a quaternion may err by this much.
constexpr double kUnitTolerance = 1e-3;

PoseRefusal validate_bone(const RigidTransform& bone) {
  // Numbers that are not finite come first: the comparisons below say nothing about them.
  if (!bone.rotation.coeffs().allFinite() || !bone.position.allFinite()) return PoseRefusal::not_finite;
  if (!(std::abs(bone.rotation.norm() - 1) <= kUnitTolerance)) return PoseRefusal::not_unit;
  if (!(bone.position.cwiseAbs().maxCoeff() <= kPositionMax_m)) return PoseRefusal::too_far;
  return PoseRefusal::none;
}

}  // namespace

PoseRefusal validate_pose(const Pose& pose) {
  for (const RigidTransform& bone : pose.bones) {
    const PoseRefusal refusal = validate_bone(bone);
    if (refusal != PoseRefusal::none) return refusal;
  }
  // The World asserts the same.
  HAIRNET_VALIDATE(is_valid(pose));
  return PoseRefusal::none;
}

const char* to_string(PoseRefusal refusal) {
  static_assert(kPositionMax_m == 10'000);
  switch (refusal) {
    case PoseRefusal::none:
      return "none";
    case PoseRefusal::not_finite:
      return "the pose is not finite";
    case PoseRefusal::not_unit:
      return "a rotation of the pose is not of length 1";
    case PoseRefusal::too_far:
      return "the pose is too far away: a coordinate is more than 10 000 m";
  }
  return "unknown";
}

}  // namespace hairnet::wire
