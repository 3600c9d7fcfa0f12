#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <functional>
#include <random>

#include "core/solver/metaball.hpp"
#include "core/solver/spring.hpp"

namespace hairnet {
namespace {

Vec3 random_vec(std::mt19937& random, double size) {
  std::uniform_real_distribution<double> range(-size, size);
  const double x = range(random), y = range(random), z = range(random);
  return {x, y, z};
}

// Central differences; the step suits lengths of centimetres in double.
Mat3 finite_difference(const std::function<Vec3(const Vec3&)>& f, const Vec3& x, double step = 1e-7) {
  Mat3 derivative;
  for (int a = 0; a < 3; ++a) {
    const Vec3 offset = step * Vec3::Unit(a);
    derivative.col(a) = (f(x + offset) - f(x - offset)) / (2 * step);
  }
  return derivative;
}

TEST(Spring, exact_jacobian_is_the_finite_difference_of_its_force) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 100; ++trial) {
    const Vec3 eps = random_vec(random, 0.05), eps_dot = random_vec(random, 1);
    const auto force = [&](const Vec3& x) { return spring_force(3, 0.02, 0.03, x, eps_dot); };
    const Mat3 exact = spring_jacobian_exact(3, 0.02, 0.03, eps, eps_dot);
    EXPECT_LT((finite_difference(force, eps) - exact).norm(), 1e-4 * (1 + exact.norm()));
  }
}

TEST(Spring, velocity_jacobian_is_the_finite_difference_of_its_force) {
  std::mt19937 random(2);
  for (int trial = 0; trial < 100; ++trial) {
    const Vec3 eps = random_vec(random, 0.05), eps_dot = random_vec(random, 1);
    const auto force = [&](const Vec3& v) { return spring_force(3, 0.02, 0.03, eps, v); };
    EXPECT_LT((finite_difference(force, eps_dot) - spring_jacobian(0.02, eps)).norm(), 1e-7);
  }
}

TEST(Spring, jacobian_in_use_is_negative_semidefinite_and_exact_at_rest_length) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 100; ++trial) {
    const Vec3 eps = random_vec(random, 0.05);
    const Mat3 used = spring_jacobian(3, eps);
    EXPECT_LE(Eigen::SelfAdjointEigenSolver<Mat3>(used).eigenvalues().maxCoeff(), 1e-12);
    EXPECT_LT((used - spring_jacobian_exact(3, 0.02, eps.norm(), eps, Vec3::Zero())).norm(), 1e-12);
  }
}

TEST(Spring, resists_lengthening_and_shortening_along_its_own_direction_only) {
  const Vec3 eps(0.02, 0, 0);
  EXPECT_LT(spring_force(3, 0, 0.01, eps, Vec3::Zero()).x(), 0);
  EXPECT_GT(spring_force(3, 0, 0.03, eps, Vec3::Zero()).x(), 0);
  EXPECT_EQ(spring_force(3, 0.1, 0.02, eps, Vec3(0, 5, 0)), Vec3::Zero());
}

TEST(Spring, elongation_is_the_difference_of_lengths_and_exactly_zero_undeformed) {
  std::mt19937 random(4);
  for (int trial = 0; trial < 100; ++trial) {
    const Vec3 rest = random_vec(random, 0.05).cast<float>().cast<double>();
    const Vec3 delta = random_vec(random, 0.02).cast<float>().cast<double>();
    EXPECT_NEAR(elongation<float>(rest.cast<float>(), delta.cast<float>()), (rest + delta).norm() - rest.norm(), 2e-8);
    EXPECT_EQ(elongation<float>(rest.cast<float>(), Vec3f::Zero()), 0.0f);
  }
}

TEST(Metaball, force_is_minus_the_gradient_of_its_potential) {
  std::mt19937 random(5);
  for (int trial = 0; trial < 100; ++trial) {
    const Vec3 r = random_vec(random, 0.07);
    const Vec3 force = metaball_force(0.03, 0.1, r);
    for (int a = 0; a < 3; ++a) {
      const Vec3 offset = 1e-7 * Vec3::Unit(a);
      const double slope =
          (metaball_potential(0.03, 0.1, Vec3(r + offset)) - metaball_potential(0.03, 0.1, Vec3(r - offset))) / 2e-7;
      EXPECT_NEAR(force[a], -slope, 1e-6);
    }
  }
}

TEST(Metaball, exact_jacobian_is_the_finite_difference_of_its_force) {
  std::mt19937 random(6);
  for (int trial = 0; trial < 100; ++trial) {
    const Vec3 r = random_vec(random, 0.07);
    const auto force = [](const Vec3& x) { return metaball_force(0.03, 0.1, x); };
    EXPECT_LT((finite_difference(force, r) - metaball_jacobian_exact(0.03, 0.1, r)).norm(), 1e-4);
  }
}

TEST(Metaball, value_slope_and_curvature_vanish_at_its_limit) {
  const Vec3 limit(0, 0.1, 0);
  EXPECT_NEAR(metaball_potential(0.03, 0.1, limit), 0, 1e-15);
  EXPECT_NEAR(metaball_force(0.03, 0.1, limit).norm(), 0, 1e-15);
  EXPECT_NEAR(metaball_jacobian_exact(0.03, 0.1, limit).norm(), 0, 1e-12);
  EXPECT_EQ(metaball_force(0.03, 0.1, Vec3(0, 0.2, 0)), Vec3::Zero());
}

TEST(Metaball, secant_never_overshoots_its_surface) {
  const double U = 0.03, rho = 0.1;
  for (double distance = 0.001; distance < rho; distance += 0.0005) {
    const Vec3 r(0, distance, 0);
    const double push = metaball_force(U, rho, r).norm() / metaball_radial_stiffness(U, rho, r);
    EXPECT_LE(push, (rho - distance) * (1 + 1e-9)) << "from " << distance << " m";
    EXPECT_GT(push, 0);
  }
}

TEST(Metaball, radial_stiffness_is_at_least_the_exact_one_and_never_negative) {
  for (double distance = 0.001; distance < 0.11; distance += 0.0005) {
    const Vec3 r(distance, 0, 0);
    const double k = metaball_radial_stiffness(0.03, 0.1, r);
    EXPECT_GE(k, 0);
    EXPECT_GE(k, -metaball_jacobian_exact(0.03, 0.1, r)(0, 0) - 1e-9);
  }
}

}  // namespace
}  // namespace hairnet
