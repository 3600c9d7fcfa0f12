#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/geometry/rigid_transform.hpp"
#include "core/result.hpp"

namespace hairnet {

// The contents of a BVH file: the skeleton and one row of channel values for each frame, in the file's own axes and
// units.
struct BvhFile {
  enum class Channel : std::uint8_t { x_position, y_position, z_position, x_rotation, y_rotation, z_rotation };
  struct Joint {
    std::string name;
    // The index of an earlier joint; -1 for a root.
    int parent = -1;
    Vec3 offset = Vec3::Zero();
    // They are in the file's order, which is the order of the rotations' product.
    std::vector<Channel> channels;
    // Its channels begin here in a row.
    std::size_t first_value = 0;
  };
  std::vector<Joint> joints;
  std::size_t values_per_frame = 0;
  std::size_t frame_count = 0;
  double frame_time_s = 0;
  // The channels frame by frame: positions in file units, rotations in degrees. Such numbers need no more digits
  // than floats have, and these values take most of the memory.
  std::vector<float> values;

  // Joint to file world, computed from its ancestors only (256 at most). Position channels replace the offset, as
  // exporters intend.
  [[nodiscard]] RigidTransform pose(std::size_t frame, std::size_t joint) const;
  // The same with all channels at rest: rotations zero, offsets as they are.
  [[nodiscard]] RigidTransform bind_pose(std::size_t joint) const;
  // The positions of all joints, in a frame or with all channels at rest.
  [[nodiscard]] std::vector<Vec3> positions(std::size_t frame) const;
  [[nodiscard]] std::vector<Vec3> zero_positions() const;
};

// Refuses nesting deeper than 256, repeated channels, values that are not finite, and more or fewer values than the
// counts say. The error begins with the line.
Result<BvhFile> decode_bvh_file(std::string_view text);

}  // namespace hairnet
