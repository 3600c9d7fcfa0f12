#pragma once

#include "core/pose/pose.hpp"

namespace hairnet {

// Hair that was thrown about can be caught where ether alone cannot free it: on the wrong side of balls around neck and
// shoulders, or folded through itself, its springs as long as designed. Upright nothing presses hair into the body, and
// without balls and springs all that is left of the forces leads home. So once the head has been upright, and neck,
// shoulders and trunk about as at rest to it, for a second, contacts fade within half a second; after three seconds,
// when hair that is not caught has come to rest, springs and attachments fade within another. Any motion of the bones,
// or a tilt, restores them at once.
class CalmRelease {
 public:
  // The share of contact to let go, 0 to 1, when `pose` has lasted `elapsed_s` more.
  double update(const Pose& pose, double elapsed_s);
  // What is left of the stiffness of springs and attachments after the last update, never 0.
  [[nodiscard]] double stiffness() const { return stiffness_; }
  [[nodiscard]] double calm_s() const { return calm_s_; }

 private:
  double calm_s_ = 0, stiffness_ = 1;
};

}  // namespace hairnet
