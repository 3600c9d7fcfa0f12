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

// The pose of a file that is the rest: its zero pose, its first frame, or the one of these that is upright.
enum class RestPose : std::uint8_t { automatic, zero, first };
Result<RestPose> parse_rest_pose(std::string_view text);  // "auto", "zero", "first"

// How a skeleton's joints become bones. An empty name is found by the usual joint names (Head, Neck, LeftCollar or
// LeftShoulder unless that is the upper arm, Chest2 or Spine2 ...). A bone that is still missing moves with the trunk
// if that was found, else it comes from PoseCompletion.
struct BvhImport {
  std::array<std::string, kBoneCount> joint_names;
  RestPose rest = RestPose::automatic;
  std::optional<Axis> up;  // none: +y, or +z if only that makes the skeleton upright
  // direction of the face in the rest pose; the world's yaw does not change; none: from left and right joints
  std::optional<Axis> face;
  std::optional<double> unit_m;  // none: metres, or the usual unit that gives the skeleton the size of a person
};

struct ImportedMotion {
  Motion motion;  // B = joint(t) joint(rest)^-1 A, A = head space at the rest pose's head joint
  std::array<std::string, kBoneCount> joints;  // the joint of each bone, empty when PoseCompletion made the bone
  std::vector<std::string> warnings;
};

Result<ImportedMotion> decode_bvh(std::string_view text, const BvhImport& import = {}, const Body* body = nullptr);

}  // namespace hairnet
