#pragma once

#include <cstdint>

#include "core/pose/pose.hpp"

namespace hairnet::made {

// The posture of head and trunk at one moment, about the bust's joints. Angles in radians: yaw about +Y, pitch about +X
// (positive looks down), roll about +Z. All fields are zero at rest, so that scaling them by an ease gives a posture
// between.
struct Gesture {
  // Moves the whole body, up and to the left.
  double lift_m = 0, sway_m = 0;
  double trunk_yaw = 0, trunk_pitch = 0, trunk_roll = 0;
  // Turns relative to the trunk; the neck takes its share.
  double head_yaw = 0, head_pitch = 0, head_roll = 0;
  // Turns forward about +Y.
  double left_shoulder = 0, right_shoulder = 0;
  // Lifts both about +Z.
  double shoulders_up = 0;
  // The speed straight ahead.
  double speed_m_per_s = 0;
  // The position on the floor, not eased.
  Vec3 place = Vec3::Zero();
  // The yaw at that place, not eased.
  double facing = 0;
  // The number of teleports so far.
  std::uint32_t place_index = 0;
};

// The bones for a gesture: joined at the bust's joints, with the head joint 1.55 m above the floor at rest. `ease`
// scales the gesture from 0 (upright) to 1; `travelled_m` is the distance covered along the facing. The pose is in the
// world, in metres.
Pose pose_of(const Gesture& gesture, double ease, double travelled_m);

}  // namespace hairnet::made
