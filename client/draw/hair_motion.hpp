#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "core/geometry/rigid_transform.hpp"
#include "core/modes/moved_lattice.hpp"

namespace hairnet::draw {

// A character that was drawn, as Stage::drawn_characters gives it.
struct MovingCharacter {
  // The same in every picture; zero means that nothing is known of its motion.
  std::uint64_t id = 0;
  RigidTransform head;  // world
  MovedLattice lattice;
  // A ball of this radius about its head contains its hair, head space, m.
  float ball_radius_m = 0;
  // The head's height on the screen, pixels.
  float head_px = 0;
  // The size of the character, as a factor on its groom's (ShownCharacter::scale).
  float scale = 1;
};

// Where hair was in the last picture, for every place where it is now (client/shaders/accumulate.frag). Hair bends, so
// its head's motion alone would smear swinging tips in the average. It keeps the nodes of a picture until the next one.
// One thread.
class HairMotion {
 public:
  // At most this many characters, the largest on the screen, have a known motion: the shader has arrays of this length.
  static constexpr std::size_t kMovingMax = 8;
  // swing() gives the motion of a character's hair at this many nodes on each axis of a cube.
  static constexpr std::size_t kSwingNodes = 8;

  // The motion of one character's hair since the last picture.
  struct Motion {
    RigidTransform head, head_before;  // world
    float scale = 1, scale_before = 1;
    float ball_radius_m = 0;
  };

  // Returns the motions since the last call, largest head first, and writes `swing`. A character that is new, or was
  // not among the largest, has none in this picture.
  std::vector<Motion> motions(std::span<const MovingCharacter> shown);
  // kSwingNodes^3 vectors for each of kMovingMax motions: where hair was, minus where it is, head space, m. Nodes fill
  // the cube about the ball evenly, x fastest.
  [[nodiscard]] const std::vector<Eigen::Vector4f>& swing() const { return swing_; }
  // Call it after a cut: the next picture then has no motions.
  void forget() { before_.clear(); }

  // The nodes as they were, copied, since their geometry may be gone in the next picture.
  struct Nodes {
    Lattice lattice;
    // Empty for hair at rest.
    std::vector<Vec3f> grid_displacements;
  };

 private:
  struct Before {
    RigidTransform head;
    float scale;
    Nodes nodes;
  };
  void write_swing(std::size_t motion, const Nodes& now, const Nodes& before, float ball_radius_m);

  // The characters of the last picture by their id, at most kMovingMax.
  std::map<std::uint64_t, Before> before_;
  std::vector<Eigen::Vector4f> swing_ =
      std::vector<Eigen::Vector4f>(kMovingMax * kSwingNodes * kSwingNodes * kSwingNodes, Eigen::Vector4f::Zero());
};

// The hair's displacement by linear FFD at a place at rest; beyond a lattice it is that of its border.
Vec3f displacement_at(const HairMotion::Nodes& nodes, const Vec3f& rest);

}  // namespace hairnet::draw
