#pragma once

#include <algorithm>

#include "core/assert.hpp"
#include "core/levels/level.hpp"

namespace hairnet {

// A point of the hair against the skin. The paper's metaball (3.3) has the potential phi = U (1 - u)^3, u = 1 at its
// limit. Here u = 1 - p / kContactDepth_m: p is how much nearer to the skin the point is than its limit, so that value,
// slope and curvature vanish where contact begins, as in the paper.
//     f = -d phi / d p = 3 U p^2 / depth^3,   df/dp = 6 U p / depth^3
// kContactSlope is the constant factor of df/dp, over U.
inline constexpr double kContactSlope = 6 / (kContactDepth_m * kContactDepth_m * kContactDepth_m);

// Contact reaches its full stiffness at this depth. A fast point meets that stiffness before it enters the skin.
// Without this limit the depth `ahead` of a thrown strand, which may be many times the depth of contact, would make the
// system as stiff.
inline constexpr double kContactStiffnessDepth_m = 0.01;
static_assert(kContactStiffnessDepth_m <= kContactDepth_m);
// The highest speed at which contact pushes a point out. The law alone is quadratic in depth, so it would throw out
// hair that a body has swept over. The force k v h is in balance v h farther out, at the end of a step with the speed
// v.
inline constexpr double kContactRecovery_m_per_s = 0.4;
// The force on a point in a step. `p`: its depth at the end of the step if it moved with the bone. `ahead`: its depth
// if it kept its velocity, measured from the tangent plane of the skin below its position at the start.
struct ContactLaw {
  // The force along the skin's normal at depth p, N.
  double force;
  // Acts on any motion relative to the bone, N/m.
  double stiffness;
};

inline ContactLaw contact_law(double U, double p, double ahead, double step_s) {
  HAIRNET_ASSERT(U >= 0);
  HAIRNET_ASSERT(step_s > 0);
  const double slope = kContactSlope * U;
  // The paper's own stiffness is zero where contact begins, so a fast point would pass the limit in one step. The
  // stiffness is therefore that of the depth which the point would reach.
  const double k = slope * std::clamp(std::max(p, ahead), 0.0, kContactStiffnessDepth_m);
  // Outside the limit the force is negative: with the stiffness, the total is zero just where the motion has brought
  // the point to its limit.
  if (p < 0) return {k * p, k};
  return {std::min(slope * p * p / 2, k * kContactRecovery_m_per_s * step_s), k};
}

}  // namespace hairnet
