#pragma once

#include <span>

#include "core/build/level.hpp"
#include "core/pose/pose.hpp"

namespace hairnet {

// Whether the lattice is turned inside out where there is hair: the Jacobian of the FFD has a negative determinant at a
// contact point. `displacement`: active order.
bool is_folded(const Level& level, std::span<const Vec3f> displacement);

// Hair that was thrown about may come to rest around the neck, its layers turned through each other; contact then keeps
// it from coming home. Only such a lattice is helped, and only while the body stands upright and at rest in the world:
// contact is let go within a second, and comes back as slowly once the body moves.
class Untangle {
 public:
  // The share of contact to let go, 0 to 1. `still_s`: how long the bones have been at rest in the world.
  double update(const Pose& pose, double still_s, double elapsed_s, const Level& level,
                std::span<const Vec3f> displacement);
  [[nodiscard]] double share() const { return share_; }

 private:
  double share_ = 0, since_look_s_ = 0;
  bool is_caught_ = false;
};

}  // namespace hairnet
