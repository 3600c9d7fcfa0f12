#pragma once

#include <algorithm>

#include "core/assert.hpp"

namespace hairnet {

// At most this share of the h k that backward Euler adds is subtracted. Up to 1/2 no mode of any stiffness gains energy
// (A stays M + h^2 k c with c >= 1/2); at 1/3 the stiffest modes, which no step resolves, still halve from step to step
// instead of ringing.
inline constexpr double kNumericalDampingShare = 1.0 / 3;
static_assert(kNumericalDampingShare <= 0.5);

// Backward Euler damps a stiffness k like a viscosity h k (it adds the damping ratio omega h / 2), so one material
// would look stiffer at long steps. The solver's own damping is therefore subtracted from the wanted viscosity q; the
// difference may be negative.
template <class S>
S solver_damping(S k, S q, S step_s) {
  HAIRNET_ASSERT(k >= 0);
  HAIRNET_ASSERT(q >= 0);
  HAIRNET_ASSERT(step_s > 0);
  return std::max(q - step_s * k, -static_cast<S>(kNumericalDampingShare) * step_s * k);
}

}  // namespace hairnet
