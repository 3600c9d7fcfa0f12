#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/geometry/rigid_transform.hpp"

namespace hairnet {

enum class Bone : std::uint8_t { head, neck, left_shoulder, right_shoulder, upper_trunk };
inline constexpr std::size_t kBoneCount = 5;
inline constexpr std::array<std::string_view, kBoneCount> kBoneNames{"head", "neck", "left_shoulder", "right_shoulder",
                                                                     "upper_trunk"};

// The bones of one character at one moment. Each is a rigid skinning transform from head space at rest to the world:
// x_world = bone x_rest. At rest all bones are equal. Metres; right-handed, +Y up, +Z out of the face.
struct Pose {
  std::array<RigidTransform, kBoneCount> bones;

  [[nodiscard]] const RigidTransform& operator[](Bone b) const { return bones[static_cast<std::size_t>(b)]; }
  [[nodiscard]] RigidTransform& operator[](Bone b) { return bones[static_cast<std::size_t>(b)]; }
  [[nodiscard]] const RigidTransform& head() const { return bones[0]; }
};

// All bones at one transform: the character at rest, moved as a whole.
Pose rigid_pose(const RigidTransform& whole);

// Interpolates bone by bone; for s see `interpolate` of RigidTransform.
Pose interpolate(const Pose& a, const Pose& b, double s);

// Whether every bone is finite and has a rotation of unit length within 1e-3.
bool is_valid(const Pose& pose);

// The pose as the wire carries it: each number rounded to float and nothing else (so rotations are of unit length to
// 1e-7). Idempotent, so that server, recording and client hold the same bits.
Pose rounded_to_wire(const Pose& pose);

// The velocity of the head from one pose to another, `interval_s` later, m/s.
Vec3 head_velocity(const Pose& from, const Pose& to, double interval_s);

// A jump too large to simulate, of the head between two poses `interval_s` apart. It turns faster than 2500 deg/s; or
// it moves faster than 25 m/s and otherwise than before: `velocity_before`, of the interval before, differs by more
// than 25 m/s and a quarter of its own speed. So a head that rides at any constant speed does not jump, nor one that
// stops.
bool is_teleport(const Pose& from, const Pose& to, double interval_s, const Vec3& velocity_before);

// What is_teleport() may compare the next interval with: the velocity between these poses, or, when it is that of a
// jump across the room, the one before.
Vec3 velocity_to_expect(const Pose& from, const Pose& to, double interval_s, const Vec3& velocity_before);

}  // namespace hairnet
