#pragma once

#include <algorithm>

#include "core/assert.hpp"
#include "core/solver/step_touch.hpp"

namespace hairnet {

// Hair against a hand or a prop: along the surface's normal the law of the skin (contact.hpp), and along the surface
// Coulomb's friction against the body's motion. It is a viscosity, N s/m, that gives the friction of the force that
// presses at the speed along the surface; slower than kTouchFrictionSpeed_m_per_s it holds hair almost.
inline double friction_viscosity(double friction, double pressing_n, double speed_m_per_s) {
  HAIRNET_ASSERT(friction >= 0);
  return friction * std::max(pressing_n, 0.0) / std::max(speed_m_per_s, kTouchFrictionSpeed_m_per_s);
}

// A point may cross a finger within a step. Its way relative to the body is tried at places that are as far apart as
// the distance to the surface there, or this share of the way. A way along a surface is then tried over its first 6/16
// alone: a body that the rest of the way would meet is found in the next step, if the point is near the body by then.
inline constexpr int kSweepPlaces = 6;
inline constexpr double kSweepShareMin = 1.0 / 16;

}  // namespace hairnet
