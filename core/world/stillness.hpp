#pragma once

#include <cmath>

#include "core/geometry/rigid_transform.hpp"

namespace hairnet {

// Bones and bodies that move less than this count as still: it is less than a headset's noise.
inline constexpr double kStillShift_m = 3e-4;
inline constexpr double kStillTurn_rad = 1e-3;

// Whether two places are the same but for a headset's noise.
inline bool is_still(const RigidTransform& a, const RigidTransform& b) {
  // Quaternions of a turn have half its angle. The dot product is taken without its sign, as q and -q are the same
  // rotation.
  static const double kTurnCosine = std::cos(kStillTurn_rad / 2);
  return (a.position - b.position).squaredNorm() <= kStillShift_m * kStillShift_m &&
         std::abs(a.rotation.dot(b.rotation)) >= kTurnCosine;
}

}  // namespace hairnet
