#pragma once

#include "core/pose/pose.hpp"

namespace hairnet {

// Computes the bones that a client does not track; a headset tracks only the head. The neck takes half of the head's
// rotation relative to the trunk, about the neck joint. The trunk stays upright, hangs from the neck joint and follows
// the head's yaw with a first-order lag; the shoulders move with the trunk. The result is continuous in the head's
// rotation. While the head is upside down, where yaw is undefined, the trunk's yaw does not change. Beyond 120 degrees,
// which no neck can bend, the neck's part of the angle decreases to zero at 180 degrees. It is for one character and
// one thread: it remembers the trunk's yaw.
class PoseCompletion {
 public:
  // `neck_joint_head`: the pivot of the neck at rest, head space, m.
  explicit PoseCompletion(const Vec3& neck_joint_head, double yaw_lag_s = 0.25);
  // `head`: head space at rest to world; `elapsed_s` since the last call, 0 to start over.
  Pose complete(const RigidTransform& head, double elapsed_s);
  // Computes only the neck, between the head and a known trunk.
  [[nodiscard]] RigidTransform neck(const RigidTransform& head, const Quat& trunk) const;

 private:
  // The place where head and neck meet the trunk's axis, head space.
  Vec3 neck_joint_;
  double yaw_lag_s_;
  double trunk_yaw_ = 0;
  bool started_ = false;
};

}  // namespace hairnet
