#pragma once

#include <algorithm>
#include <cmath>

#include "core/geometry/vec.hpp"

namespace hairnet {

// Paper 3.3: phi = U (1 - u)^3 with u = |r|^2 / rho^2 inside the ball, r = p - c. Value, slope and curvature vanish at
// the limit. All functions expect rho > 0.
template <class S>
S metaball_potential(S U, S rho, const Eigen::Matrix<S, 3, 1>& r) {
  const S u = r.squaredNorm() / (rho * rho);
  return u < 1 ? U * (1 - u) * (1 - u) * (1 - u) : S(0);
}

// f = -d phi / d r = (6 U / rho^2) (1 - u)^2 r
template <class S>
Eigen::Matrix<S, 3, 1> metaball_force(S U, S rho, const Eigen::Matrix<S, 3, 1>& r) {
  const S u = r.squaredNorm() / (rho * rho);
  if (!(u < 1)) return Eigen::Matrix<S, 3, 1>::Zero();
  return (6 * U / (rho * rho)) * (1 - u) * (1 - u) * r;
}

// df/dp exactly, for tests; indefinite.
inline Mat3 metaball_jacobian_exact(double U, double rho, const Vec3& r) {
  const double u = r.squaredNorm() / (rho * rho);
  if (!(u < 1)) return Mat3::Zero();
  return (6 * U / (rho * rho)) *
         ((1 - u) * (1 - u) * Mat3::Identity() - (4 * (1 - u) / (rho * rho)) * r * r.transpose());
}

// The solver's df/dp is -k_r r^ r^^T with this k_r: no tangential part, and radially at least the secant |f| / (rho -
// |r|), so that a node pushed out stops at the surface and does not overshoot it.
template <class S>
S metaball_radial_stiffness(S U, S rho, const Eigen::Matrix<S, 3, 1>& r) {
  const S u = r.squaredNorm() / (rho * rho);
  if (!(u < 1)) return S(0);
  return (6 * U / (rho * rho)) * (1 - u) * std::max(5 * u - 1, u + std::sqrt(u));
}

}  // namespace hairnet
