#pragma once

#include "core/assert.hpp"
#include "core/geometry/vec.hpp"

namespace hairnet {

// Eq. 3: a spring's epsilon joins its two ends. sigma = -(T(|eps| - |eps_0|) + q eps'.e) e, e = eps / |eps|. In the
// paper the tension is T = k x. Real hair hardly stretches and buckles under compression, so here a spring is stiffer
// beyond a positive strain and softer below a negative one. T stays convex.
// Strains are relative to the rest length; kStiffening is the addition to k, and kBuckling the reduction of k, both
// over k.
inline constexpr double kStiffStrain = 0.02, kStiffening = 2;
inline constexpr double kBucklingStrain = 0.05, kBuckling = 0.9;

static_assert(kStiffening >= 0 && kBuckling >= 0, "the tension is convex");
static_assert(kBuckling < 1, "a shorter spring pushes more");

// T = k (x + change (x - beyond)): the branch of the law at some elongation.
struct SpringBranch {
  double change, beyond;
};
inline SpringBranch spring_branch(double rest_length, double x) {
  HAIRNET_ASSERT(rest_length >= 0);
  if (x > kStiffStrain * rest_length) return {kStiffening, kStiffStrain * rest_length};
  if (x < -kBucklingStrain * rest_length) return {-kBuckling, -kBucklingStrain * rest_length};
  return {0, 0};
}
// The branches meet without a jump, since the addition is zero at `beyond`.
inline double spring_tension(double k, double rest_length, double x) {
  const SpringBranch branch = spring_branch(rest_length, x);
  return k * (x + branch.change * (x - branch.beyond));
}
// dT/dx
inline double spring_stiffness(double k, double rest_length, double x) {
  return k * (1 + spring_branch(rest_length, x).change);
}
// The integral of T, J.
inline double spring_energy(double k, double rest_length, double x) {
  const SpringBranch branch = spring_branch(rest_length, x);
  const double over = x - branch.beyond;
  return 0.5 * k * (x * x + branch.change * over * over);
}

// These three assert that the spring has a length, as one of no length has no direction.
inline Vec3 spring_force(double k, double q, double rest_length, const Vec3& eps, const Vec3& eps_dot) {
  HAIRNET_ASSERT(eps.norm() > 0);
  const Vec3 e = eps.normalized();
  return -(spring_tension(k, rest_length, eps.norm() - rest_length) + q * eps_dot.dot(e)) * e;
}

// The part of d sigma / d eps that the solver uses, -k e e^T with k = dT/dx. It is always negative semi-definite, and
// the exact derivative at the rest length with eps' = 0. With q instead of k it is exactly d sigma / d eps'.
inline Mat3 spring_jacobian(double k, const Vec3& eps) {
  HAIRNET_ASSERT(eps.norm() > 0);
  const Vec3 e = eps.normalized();
  return -k * e * e.transpose();
}

// The exact d sigma / d eps. Its other terms push across a shortened spring and may therefore be indefinite.
inline Mat3 spring_jacobian_exact(double k, double q, double rest_length, const Vec3& eps, const Vec3& eps_dot) {
  const double length = eps.norm(), x = length - rest_length;
  HAIRNET_ASSERT(length > 0);
  const Vec3 e = eps / length;
  const Mat3 across = Mat3::Identity() - e * e.transpose();
  const Mat3 turning = (eps_dot.dot(e) * across + e * (across * eps_dot).transpose()) / length;
  return -spring_stiffness(k, rest_length, x) * e * e.transpose() -
         spring_tension(k, rest_length, x) / length * across - q * turning;
}

// |eps_0 + delta| - |eps_0| without cancellation: exactly 0 for delta = 0.
template <class S>
S elongation(const Eigen::Matrix<S, 3, 1>& rest, const Eigen::Matrix<S, 3, 1>& delta) {
  return (S(2) * rest + delta).dot(delta) / ((rest + delta).norm() + rest.norm());
}

}  // namespace hairnet
