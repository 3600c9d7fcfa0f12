#pragma once

#include <span>

#include "core/levels/level.hpp"
#include "core/pose/pose.hpp"

namespace hairnet {

// Whether the lattice is turned inside out where there is hair: the Jacobian of the FFD has a negative determinant at a
// contact point. `displacement`: active order.
bool is_folded(const Level& level, std::span<const Vec3f> displacement);

// Hair that was thrown about may come to rest turned through itself: contact holds its layers around the neck, or
// springs that buckled hold a cell inside out. Only such a lattice is helped, and only while the body stands upright
// and at rest in the world: contact and springs are let go within a second, so that the ether leads the hair home. They
// come back as slowly once it is there, where both are zero, or once the body moves.
class Untangle {
 public:
  // To be called every tick. `still_s`: how long the bones have been at rest in the world.
  void update(const Pose& pose, double still_s, double elapsed_s, const Level& level,
              std::span<const Vec3f> displacement);
  // The share of contact to let go, 0 to 1, and the factor of the stiffness of springs and attachments.
  [[nodiscard]] double share() const { return share_; }
  [[nodiscard]] double stiffness() const;

 private:
  double share_ = 0, since_look_s_ = 0;
  bool is_tangled_ = false;
};

}  // namespace hairnet
