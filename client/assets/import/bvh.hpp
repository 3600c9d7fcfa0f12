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

// The pose of a file that is the rest: its zero pose, its first frame, or the one of these that is upright. Programs
// export actors in different rest poses: a T pose with zero rotations, or a zero pose with all bones along one axis
// that no person can take.
enum class RestPose : std::uint8_t { automatic, zero, first };
Result<RestPose> parse_rest_pose(std::string_view text);  // "auto", "zero", "first"

// How a skeleton's joints become bones. An empty name is found by the usual joint names (Head, Neck, LeftCollar or
// LeftShoulder unless that is the upper arm, Chest2 or Spine2 ...). A bone that is still missing moves with the trunk
// if that was found, else it comes from PoseCompletion.
struct BvhImport {
  std::array<std::string, kBoneCount> joint_names;
  RestPose rest = RestPose::automatic;
  // Without it +y is up, or +z if only that makes the skeleton upright.
  std::optional<Axis> up;
  // The direction of the face in the rest pose. The world's yaw does not change. Without it left and right joints tell
  // the face.
  std::optional<Axis> face;
  // Without it a unit is a metre, or the usual unit that gives the skeleton the size of a person.
  std::optional<double> unit_m;
};

// The poses are in metres and the world's axes, +Y up. The yaw and place of the file remain: an actor who walks away
// does so in the world.
struct ImportedMotion {
  // B = joint(t) joint(rest)^-1 A, where A is head space at the rest pose's head joint.
  Motion motion;
  // The joint of each bone; empty when PoseCompletion made the bone.
  std::array<std::string, kBoneCount> joints;
  std::vector<std::string> warnings;
};

// `body` gives the neck joint for bones that follow by rule; null takes that of the default body. Returns an error for
// a file that is damaged or has no head, for an unknown joint name, and for numbers beyond 1000 km. Memory is bounded
// by the size of the text.
Result<ImportedMotion> decode_bvh(std::string_view text, const BvhImport& import = {}, const Body* body = nullptr);

}  // namespace hairnet
