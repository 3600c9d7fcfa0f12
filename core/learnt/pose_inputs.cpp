#include "core/learnt/pose_inputs.hpp"

#include <algorithm>

#include "core/gravity.hpp"

namespace hairnet {
namespace {

// Points in head space at rest, m, whose places tell how the trunk and the shoulders have moved.
const Vec3 kTrunk(0, -0.2, 0), kLeftShoulder(0.15, -0.22, 0), kRightShoulder(-0.15, -0.22, 0);

// A rotation as three numbers: its axis times twice the sine of half its angle. For small angles this is nearly axis
// times angle, it is as good an input, and it costs less.
Vec3 turn_of(const Quat& rotation) {
  // q and -q are one rotation; the sign chosen is that of the shorter turn.
  return (rotation.w() < 0 ? -2.0 : 2.0) * rotation.vec();
}

// How far the point of the bone at this place of the design has moved, in decimetres (PoseInputs).
Vec3 shift_dm(const RigidTransform& bone, const Vec3& place) {
  return 10 * (bone.point(place) - place);
}

}  // namespace

PoseInputs PoseHistory::next(const Pose& pose, bool air_is_carried) {
  // A jump is found by the rule of World, so a network begins again where its hair does not move with the jump.
  if (known_count_ > 0) {
    if (is_teleport(last_, pose, kLearntTick_s, expected_world_)) known_count_ = 0;
    expected_world_ = velocity_to_expect(last_, pose, kLearntTick_s, expected_world_);
  }
  const RigidTransform& head = pose.head();
  const RigidTransform to_head = head.inverse();
  Vec3 velocity = Vec3::Zero(), acceleration = Vec3::Zero(), spin = Vec3::Zero();
  if (known_count_ > 0) {
    velocity = head_velocity(last_, pose, kLearntTick_s);
    spin = turn_of(last_.head().rotation.conjugate() * head.rotation) / kLearntTick_s;
  }
  if (known_count_ > 1) acceleration = (velocity - velocity_world_) / kLearntTick_s;
  velocity_world_ = velocity;
  known_count_ = std::min(known_count_ + 1, 2);
  last_ = pose;

  const RigidTransform trunk = to_head * pose[Bone::upper_trunk];
  const std::array<Vec3, kPoseInputCount / 3> inputs{Vec3::UnitY() - to_head.vector(Vec3::UnitY()),
                                                     air_is_carried ? Vec3(Vec3::Zero()) : to_head.vector(velocity),
                                                     to_head.vector(acceleration) / kGravity_m_per_s2,
                                                     spin,
                                                     turn_of(trunk.rotation),
                                                     shift_dm(trunk, kTrunk),
                                                     shift_dm(to_head * pose[Bone::left_shoulder], kLeftShoulder),
                                                     shift_dm(to_head * pose[Bone::right_shoulder], kRightShoulder)};
  PoseInputs out;
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = static_cast<float>(inputs[i / 3][static_cast<int>(i % 3)]);
  return out;
}

}  // namespace hairnet
