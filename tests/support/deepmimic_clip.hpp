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
  // The position of the root joint, m, with y up and the face towards +x.
  Vec3 root = Vec3::Zero();
  // Each joint's rotation relative to its parent.
  std::array<Quat, kDeepMimicJointCount> rotations{};
};

// A clip at a constant rate.
struct DeepMimicClip {
  double rate_hz = 60;
  // There is at least one frame.
  std::vector<DeepMimicFrame> frames;
  // Plain sentences about what was mended.
  std::vector<std::string> warnings;
};

// The JSON of a clip, whose frames may last differently long, resampled: positions linearly, rotations by slerp.
// Quaternions are normalised. Refuses numbers that are missing or not finite, quaternions of zero, and frames longer
// than 10 s.
Result<DeepMimicClip> decode_deepmimic_clip(std::string_view text, double rate_hz);

}  // namespace hairnet
