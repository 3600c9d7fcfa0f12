#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "client/assets/import/bvh.hpp"
#include "client/assets/import/bvh_file.hpp"
#include "core/result.hpp"

namespace hairnet {

// The pose in which a skeleton is upright, in the file's axes. The importer uses it as joint(rest) of B = joint(t)
// joint(rest)^-1 A.
struct SkeletonRest {
  // The rest pose is the first frame; otherwise it is the zero pose: no rotations, offsets as they are.
  bool is_first_frame = false;
  Vec3 up = Vec3::UnitY();
  // Where the face looks: level, of unit length.
  Vec3 face = Vec3::UnitZ();
  double unit_m = 1;

  [[nodiscard]] RigidTransform joint(const BvhFile& file, std::size_t joint) const {
    return is_first_frame ? file.pose(0, joint) : file.bind_pose(joint);
  }
};

// Determines what `import` does not specify: the pose in which the head is above the hips and no limb points up, the up
// axis, the facing direction from the left and right joints, and the unit that gives a human size. Adds a warning for
// each value that differs from the default (zero pose, +y, +z, metres). Returns an error for a skeleton that is upright
// in no pose, unless `import` names the pose. `head` is the index of the head's joint.
Result<SkeletonRest> find_rest(const BvhFile& file, std::size_t head, const BvhImport& import,
                               std::vector<std::string>& warnings);

// "mixamorig:Left_Shoulder" -> "leftshoulder"
std::string plain_joint_name(std::string_view name);

}  // namespace hairnet
