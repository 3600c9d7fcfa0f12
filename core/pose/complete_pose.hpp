#pragma once

#include "core/groom/body.hpp"
#include "core/pose/pose.hpp"

namespace hairnet {

// Gives the bones that a client does not have (a headset gives only the head) by a stated rule: the neck takes half of
// the head's rotation away from the trunk about the neck joint; the trunk stays upright, its yaw following the head's
// with a first-order lag, and hangs from the neck joint; shoulders move with the trunk.
// Continuous in the head's rotation everywhere: upside down, where yaw means nothing, the trunk's stands still, and
// beyond 120 degrees, where no neck bends, the neck's share of the angle falls to none at 180.
class PoseCompletion {
 public:
  explicit PoseCompletion(const Body& body, double yaw_lag_s = 0.25);
  // `head`: head space at rest to world; `elapsed_s` since the last call, 0 to start over.
  Pose complete(const RigidTransform& head, double elapsed_s);
  // The neck alone, between the head and a trunk that is known.
  [[nodiscard]] RigidTransform neck(const RigidTransform& head, const Quat& trunk) const;

 private:
  Vec3 neck_joint_;  // where head and neck meet the trunk's axis, head space
  double yaw_lag_s_;
  double trunk_yaw_ = 0;
  bool started_ = false;
};

}  // namespace hairnet
