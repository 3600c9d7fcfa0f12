#pragma once

#include <cstdint>

#include "core/pose/pose.hpp"

namespace hairnet::made {

// The posture of head and trunk at one moment, about the bust's joints. Angles in radians: yaw about +Y, pitch about +X
// (positive looks down), roll about +Z.
struct Gesture {
  double lift_m = 0, sway_m = 0;  // of the whole body, up and to the left
  double trunk_yaw = 0, trunk_pitch = 0, trunk_roll = 0;
  double head_yaw = 0, head_pitch = 0, head_roll = 0;  // relative to the trunk; the neck takes its share
  double left_shoulder = 0, right_shoulder = 0;        // forward about +Y
  double shoulders_up = 0;                             // both, about +Z
  double speed_m_per_s = 0;                            // straight ahead
  Vec3 place = Vec3::Zero();                           // position on the floor, not eased
  double facing = 0;                                   // yaw there, not eased
  std::uint32_t place_index = 0;                       // counts teleports
};

// The bones for a gesture: joined at the bust's joints, with the head joint 1.55 m above the floor at rest. `ease`
// scales the gesture from 0 (upright) to 1; `travelled_m` is the distance covered along the facing.
Pose pose_of(const Gesture& gesture, double ease, double travelled_m);

}  // namespace hairnet::made
