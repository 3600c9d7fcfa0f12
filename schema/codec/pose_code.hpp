#pragma once

#include <cstddef>

#include "core/pose/pose.hpp"
#include "schema/codec/bits.hpp"

// The pose of a frame as bits. The head is absolute; each other bone is coded as what differs from a body whose bones
// meet at joints.
namespace hairnet::codec {

// The step of the head's position.
inline constexpr double kHeadPositionStep_m = 1.0 / (1 << 13);
// The step of the positions of all bones but the head.
inline constexpr double kBonePositionStep_m = 1.0 / (1 << 9);
// The step of a component of a quaternion.
inline constexpr double kBoneRotationStep = 1.0 / (1 << 9);

// An upper bound of the bytes of a pose. pose_code.cpp asserts it.
inline constexpr std::size_t kPoseBytesMax = 96;

// Writes the pose, and returns it as decode_pose gives it. The head's position errs by at most half a step, and its
// rotation by 0.25 mrad. Other bones err by 1.8 mm at their joints, and by 4 mrad, or 6 mrad where they are turned so
// far from the head as nobody can. Asserts that the pose is valid and within the wire's bounds.
Pose encode_pose(const Pose& pose, BitWriter& writer);

// Returns false when a position is out of the wire's bounds; check reader.beyond_end() as well.
[[nodiscard]] bool decode_pose(BitReader& reader, Pose& pose);

}  // namespace hairnet::codec
