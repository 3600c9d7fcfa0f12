#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/geometry/rigid_transform.hpp"
#include "core/result.hpp"

namespace hairnet {

// The joints of DeepMimic's humanoid, in the order in which a frame holds them.
enum class DeepMimicJoint : std::uint8_t {
  root,
  chest,
  neck,
  right_hip,
  right_knee,
  right_ankle,
  right_shoulder,
  right_elbow,
  left_hip,
  left_knee,
  left_ankle,
  left_shoulder,
  left_elbow
};
inline constexpr std::size_t kDeepMimicJointCount = 13;

struct DeepMimicFrame {
  Vec3 root = Vec3::Zero();                            // m, y up, facing +x
  std::array<Quat, kDeepMimicJointCount> rotations{};  // relative to the parent
};

// A clip at a constant rate.
struct DeepMimicClip {
  double rate_hz = 60;
  std::vector<DeepMimicFrame> frames;  // at least one
  std::vector<std::string> warnings;   // plain sentences
};

// The JSON of a clip, whose frames may last differently long, resampled: positions linearly, rotations by slerp.
// Quaternions are normalised. Refuses numbers that are missing or not finite, quaternions of zero, and frames longer
// than 10 s.
Result<DeepMimicClip> decode_deepmimic_clip(std::string_view text, double rate_hz);

}  // namespace hairnet
