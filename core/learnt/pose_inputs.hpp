#pragma once

#include <array>
#include <cstddef>

#include "core/pose/pose.hpp"

namespace hairnet {

// The time from one pose of a learnt groom to the next. Programs with another rate interpolate poses to this one, and
// coefficients from it: the network's state has no other step.
inline constexpr double kLearntTick_s = 1.0 / 30;
constexpr bool is_learnt_tick(double tick_s) {
  return tick_s > 0.999 * kLearntTick_s && tick_s < 1.001 * kLearntTick_s;
}

// More inputs are worse: 57 (also the neck, turns of the shoulders, angular accelerations, rates of the body) erred by
// 45 % of the motion, where these err by 38 %.
inline constexpr std::size_t kPoseInputCount = 24;
using PoseInputs = std::array<float, kPoseInputCount>;

// Describes the motion of one character in the axes of its head. Three numbers each: where down is, less the same of
// an upright head; the head's velocity (m/s), acceleration (over that of gravity) and angular velocity (rad/s); the
// turn of the upper trunk relative to the head; how far the trunk, the left and the right shoulder are from their
// places in the design (dm). An upright head at rest gives zeros when the body is as in the design.
class PoseHistory {
 public:
  // The next pose, kLearntTick_s after the last. A first pose, and one after a teleport, counts as still; an
  // acceleration needs three poses. `air_is_carried`: the velocity is 0, since it counts against the air.
  PoseInputs next(const Pose& pose, bool air_is_carried = false);
  // The next pose counts as still, like a first one.
  void forget() { known_count_ = 0; }

 private:
  // The last pose, and the head's velocity to it, world, m/s.
  Pose last_;
  Vec3 velocity_world_ = Vec3::Zero();
  // What velocity_to_expect() returned for the last pose, also after a jump. Against it the next pose's velocity tells
  // a teleport.
  Vec3 expected_world_ = Vec3::Zero();
  // How many poses since the last teleport are known, at most 2.
  int known_count_ = 0;
};

}  // namespace hairnet
