#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/assets/import/placement.hpp"
#include "core/pose/motion.hpp"
#include "core/result.hpp"

namespace hairnet {

// The pose of a file that is the rest: its zero pose, its first frame, or whichever of the two is upright.
enum class RestPose : std::uint8_t { automatic, zero, first };
Result<RestPose> parse_rest_pose(std::string_view text);  // "auto", "zero", "first"

// How a skeleton's joints become bones. A name left empty is found by the usual joint names (Head, Neck, LeftCollar or
// LeftShoulder unless that is the upper arm, Chest2 or Spine2 ...). A bone still missing goes with the trunk where that
// was found, else it comes from PoseCompletion.
struct BvhImport {
  std::array<std::string, kBoneCount> joint_names;
  RestPose rest = RestPose::automatic;
  std::optional<Axis> up;        // none: +y, or +z where that alone makes the skeleton upright
  std::optional<Axis> face;      // where the rest pose looks, the world's yaw is kept; none: by left and right joints
  std::optional<double> unit_m;  // none: metres, or the usual unit that makes the skeleton a person
};

struct ImportedMotion {
  Motion motion;  // B = joint(t) joint(rest)^-1 A, A = head space at the rest pose's head joint
  std::array<std::string, kBoneCount> joints;  // the joint each bone came from, empty when completed by rule
  std::vector<std::string> warnings;
};

Result<ImportedMotion> decode_bvh(std::string_view text, const BvhImport& import = {}, const Body* body = nullptr);

}  // namespace hairnet
