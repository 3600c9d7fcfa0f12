#pragma once

#include <span>

#include "core/levels/level.hpp"
#include "core/pose/pose.hpp"

namespace hairnet {

// Whether the lattice is turned inside out where there is hair: the Jacobian of the FFD has a negative determinant at a
// contact point. `displacement` is in active order. Asserts that it fits the level.
bool is_folded(const Level& level, std::span<const Vec3f> displacement);

// Resolves hair that rests turned through itself: contact keeps its layers around the neck, or buckled springs keep a
// cell inside out. It acts only on such a lattice, and only while the body stands upright and at rest in the world.
// Contact and springs then fade out within a second, and the ether pulls the hair back to the design. They fade in at
// the same rate once the hair is there, where both are zero, or once the body moves.
class Untangle {
 public:
  // Call it every tick. `still_s`: how long the bones have been at rest in the world. Asserts that time passes and that
  // `displacement` fits the level.
  void update(const Pose& pose, double still_s, double elapsed_s, const Level& level,
              std::span<const Vec3f> displacement);
  // The share of contact that is switched off, 0 to 1, and the factor of the stiffness of springs and attachments.
  [[nodiscard]] double share() const { return share_; }
  [[nodiscard]] double stiffness() const;

 private:
  // The share of contact that is switched off, and the time since the last test for folds, s.
  double share_ = 0, since_look_s_ = 0;
  // The lattice was folded at a test, and has not come back to its design since.
  bool is_tangled_ = false;
};

}  // namespace hairnet
