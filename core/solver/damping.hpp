#pragma once

#include <algorithm>

namespace hairnet {

// Of the h k that backward Euler adds, at most this share is taken back. Up to 1/2 no mode of any stiffness gains
// energy (A stays M + h^2 k c with c >= 1/2); at 1/3 the stiffest ones, which no step resolves, still halve from step
// to step instead of ringing.
inline constexpr double kNumericalDampingShare = 1.0 / 3;

// Backward Euler damps a stiffness k as a viscosity h k would (zeta = omega h / 2, model section 6), so that one
// material would look stiffer at long steps. What the solver adds by itself is taken off the viscosity asked for, q;
// what is left may be negative.
template <class S>
S solver_damping(S k, S q, S step_s) {
  return std::max(q - step_s * k, -static_cast<S>(kNumericalDampingShare) * step_s * k);
}

}  // namespace hairnet
