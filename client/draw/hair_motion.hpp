#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "core/geometry/rigid_transform.hpp"
#include "core/modes/moved_lattice.hpp"

namespace hairnet::draw {

// A character that was drawn.
struct MovingCharacter {
  // The same in every picture; zero means that nothing is known of its motion.
  std::uint64_t id = 0;
  RigidTransform head;  // world
  MovedLattice lattice;
  // A ball of this radius about its head contains its hair, head space.
  float ball_radius_m = 0;
  float head_px = 0;  // on the screen
  float scale = 1;    // as that of a ShownCharacter
};

// Where hair was in the last picture, for every place where it is now (client/shaders/accumulate.frag).
class HairMotion {
 public:
  static constexpr std::size_t kMovingMax = 8;   // characters whose motion is known; the largest
  static constexpr std::size_t kSwingNodes = 8;  // on each axis of a character's swing

  // The motion of one character's hair since the last picture.
  struct Motion {
    RigidTransform head, head_before;  // world
    float scale = 1, scale_before = 1;
    float ball_radius_m = 0;
  };

  // Returns the motions since the last call, and writes `swing`.
  std::vector<Motion> motions(std::span<const MovingCharacter> shown);
  // kSwingNodes^3 vectors for each of kMovingMax motions: where hair was, minus where it is, head space, m.
  [[nodiscard]] const std::vector<Eigen::Vector4f>& swing() const { return swing_; }
  void forget() { before_.clear(); }

  // Nodes as they were; their geometry may be gone.
  struct Nodes {
    Lattice lattice;
    std::vector<Vec3f> grid_displacements;  // empty: at rest
  };

 private:
  struct Before {
    RigidTransform head;
    float scale;
    Nodes nodes;
  };
  void write_swing(std::size_t motion, const Nodes& now, const Nodes& before, float ball_radius_m);

  std::map<std::uint64_t, Before> before_;
  std::vector<Eigen::Vector4f> swing_ =
      std::vector<Eigen::Vector4f>(kMovingMax * kSwingNodes * kSwingNodes * kSwingNodes, Eigen::Vector4f::Zero());
};

// The hair's displacement by linear FFD at a place at rest; beyond a lattice it is that of its border.
Vec3f displacement_at(const HairMotion::Nodes& nodes, const Vec3f& rest);

}  // namespace hairnet::draw
