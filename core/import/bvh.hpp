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

// How a skeleton's joints become bones. A name left empty is found by the usual joint names (Head, Neck, LeftShoulder
// or LeftCollar, RightShoulder or RightCollar, Spine2 or Chest …); a bone still missing comes from PoseCompletion.
struct BvhImport {
  std::array<std::string, kBoneCount> joint_names;
  Axis up = Axis::plus_y;
  Axis face = Axis::plus_z;
  double unit_m = 1;
};

struct ImportedMotion {
  Motion motion;                               // B = joint(t) joint(bind)^-1 A, the head joint at head space's origin
  std::array<std::string, kBoneCount> joints;  // the joint each bone came from, empty when completed by rule
  std::vector<std::string> warnings;
};

Result<ImportedMotion> decode_bvh(std::string_view text, const BvhImport& import = {}, const Body* body = nullptr);

}  // namespace hairnet
