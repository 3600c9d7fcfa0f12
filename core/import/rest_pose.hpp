#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/import/bvh.hpp"
#include "core/import/bvh_file.hpp"
#include "core/result.hpp"

namespace hairnet {

// The pose in which a skeleton is upright, in the file's axes.
struct SkeletonRest {
  bool is_first_frame = false;  // else the zero pose: no rotations, offsets as they are
  Vec3 up = Vec3::UnitY();
  Vec3 face = Vec3::UnitZ();  // level, of unit length
  double unit_m = 1;

  [[nodiscard]] RigidTransform joint(const BvhFile& file, std::size_t joint) const {
    return is_first_frame ? file.pose(0, joint) : file.bind_pose(joint);
  }
};

// What `import` leaves open is found: the pose in which the head is above the hips and no limb points up, the axis that
// is up, the way that left and right joints make it face, and the unit that makes it a person. What was taken instead
// of the usual (zero pose, +y, +z, metres) is added to `warnings`. Refuses a skeleton that is upright nowhere, unless
// `import` names the pose.
Result<SkeletonRest> find_rest(const BvhFile& file, std::size_t head, const BvhImport& import,
                               std::vector<std::string>& warnings);

// "mixamorig:Left_Shoulder" -> "leftshoulder"
std::string plain_joint_name(std::string_view name);

}  // namespace hairnet
