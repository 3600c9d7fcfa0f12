#pragma once

#include <optional>
#include <unordered_map>
#include <vector>

#include "core/geometry/mesh_query.hpp"
#include "core/groom/groom.hpp"

namespace hairnet::fidelity {

// How deep points lie in a body that its bones move. Only the triangles within reach of the hair are kept, so that a
// whole body costs no more than a bust; the bust is then open below. Inside is where the winding number exceeds one
// half, which an open end shifts a little, in the design as in motion: depths are to be compared with the design's.
class BodyDepth {
 public:
  explicit BodyDepth(const Groom& groom);

  // Bends the body, in head space: `pose` may have the head anywhere.
  void bend(const Pose& pose);

  struct Depth {
    double depth_m = 0;      // below the skin, 0 outside
    Bone bone = Bone::head;  // that moves the nearest skin most, where depth_m > 0
  };
  [[nodiscard]] Depth at(const Vec3f& point_head);

 private:
  // A cube of space, known by its middle: where the skin is farther than the cube reaches, all of it is on one side.
  struct Cell {
    bool inside = false, near_skin = true;
  };
  const Cell& cell_at(const Vec3& point);

  Body near_;  // the body near the hair
  std::vector<Bone> bone_of_triangle_;
  std::optional<MeshQuery> skin_;
  std::unordered_map<std::uint64_t, Cell> cells_;
};

}  // namespace hairnet::fidelity
