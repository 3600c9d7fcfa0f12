#pragma once

#include "core/geometry/vec.hpp"

namespace hairnet {

// Eq. 3: a spring's epsilon joins its two ends. sigma = -(k (|eps| - |eps_0|) + q eps'.e) e, e = eps / |eps|.
inline Vec3 spring_force(double k, double q, double rest_length, const Vec3& eps, const Vec3& eps_dot) {
  const Vec3 e = eps.normalized();
  return -(k * (eps.norm() - rest_length) + q * eps_dot.dot(e)) * e;
}

// The part of d sigma / d eps that the solver uses, -k e e^T: negative semi-definite always, and the exact derivative
// at the rest length with eps' = 0. With q instead of k it is d sigma / d eps', exactly.
inline Mat3 spring_jacobian(double k, const Vec3& eps) {
  const Vec3 e = eps.normalized();
  return -k * e * e.transpose();
}

// The exact d sigma / d eps. Its further terms push across a shortened spring and so may be indefinite.
inline Mat3 spring_jacobian_exact(double k, double q, double rest_length, const Vec3& eps, const Vec3& eps_dot) {
  const double length = eps.norm();
  const Vec3 e = eps / length;
  const Mat3 across = Mat3::Identity() - e * e.transpose();
  const Mat3 turning = (eps_dot.dot(e) * across + e * (across * eps_dot).transpose()) / length;
  return -k * e * e.transpose() - k * (length - rest_length) / length * across - q * turning;
}

// |eps_0 + delta| - |eps_0| without cancellation: exactly 0 for delta = 0.
template <class S>
S elongation(const Eigen::Matrix<S, 3, 1>& rest, const Eigen::Matrix<S, 3, 1>& delta) {
  return (S(2) * rest + delta).dot(delta) / ((rest + delta).norm() + rest.norm());
}

}  // namespace hairnet
