#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/import/placement.hpp"
#include "core/pose/motion.hpp"
#include "core/result.hpp"

namespace hairnet {

// How a skeleton's joints become bones. A name left empty is found by the usual joint names (Head, Neck, LeftCollar or
// LeftShoulder unless that is the upper arm, Chest2 or Spine2 ...). A bone still missing goes with the trunk where that
// was found, else it comes from PoseCompletion.
struct BvhImport {
  std::array<std::string, kBoneCount> joint_names;
  Axis up = Axis::plus_y;
  Axis face = Axis::plus_z;  // where the bind pose looks; the world's yaw is kept
  double unit_m = 1;
};

struct ImportedMotion {
  Motion motion;  // B = joint(t) joint(bind)^-1 A, A = head space at the bind pose's head joint
  std::array<std::string, kBoneCount> joints;  // the joint each bone came from, empty when completed by rule
  std::vector<std::string> warnings;
};

Result<ImportedMotion> decode_bvh(std::string_view text, const BvhImport& import = {}, const Body* body = nullptr);

}  // namespace hairnet
