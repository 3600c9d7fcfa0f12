#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <functional>
#include <random>

#include "core/solver/contact.hpp"
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

// The springs of these tests have k = 3 N/m, q = 0.02 N s/m and a rest length of 3 cm, unless a case gives others. The
// arguments of spring_force() are k, q, the rest length, epsilon and its rate.
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

TEST(Spring, force_is_minus_the_slope_of_its_energy_on_every_branch) {
  // With a rest length of 3 cm, the branches of the law meet at -1.5 mm (kBucklingStrain) and at 0.6 mm
  // (kStiffStrain). No step of this loop hits such a bend, where the slope is not defined.
  for (double x = -0.009; x < 0.02; x += 0.00037) {
    const double slope = (spring_energy(3, 0.03, x + 1e-7) - spring_energy(3, 0.03, x - 1e-7)) / 2e-7;
    EXPECT_NEAR(spring_tension(3, 0.03, x), slope, 1e-6) << "at " << x;
  }
}

TEST(Spring, tension_is_the_papers_at_small_strain_continuous_and_convex) {
  // An elongation of 0.5 mm is a strain of 1.7 %, within kStiffStrain = 2 % and kBucklingStrain = 5 %.
  EXPECT_EQ(spring_tension(3, 0.03, 0.0005), 3 * 0.0005);
  EXPECT_EQ(spring_tension(3, 0.03, -0.0005), -3 * 0.0005);
  for (const double bend : {kStiffStrain * 0.03, -kBucklingStrain * 0.03})
    EXPECT_NEAR(spring_tension(3, 0.03, bend - 1e-12), spring_tension(3, 0.03, bend + 1e-12), 1e-9);
  double last = 0;
  for (double x = -0.02; x < 0.02; x += 0.0001) {
    EXPECT_GE(spring_stiffness(3, 0.03, x), last);
    EXPECT_GT(spring_stiffness(3, 0.03, x), 0);
    last = spring_stiffness(3, 0.03, x);
  }
}

TEST(Contact, force_is_minus_the_slope_of_a_metaballs_potential) {
  const double U = 0.03;
  // With u = 1 - p / kContactDepth_m, this is U (1 - u)^3.
  const auto potential = [&](double p) { return U * std::pow(p / kContactDepth_m, 3); };
  for (double p = 0.0005; p < 0.008; p += 0.0005) {
    const double slope = (potential(p + 1e-7) - potential(p - 1e-7)) / 2e-7;
    // In a step of 1 s the limit of recovery (kContactRecovery_m_per_s) allows 40 cm, so it does not act at these
    // depths.
    EXPECT_NEAR(contact_law(U, p, p, 1).force, slope, 1e-6);
  }
}

TEST(Contact, begins_without_force_and_stiffness) {
  const ContactLaw law = contact_law(0.03, 0, 0, 1.0 / 50);
  EXPECT_EQ(law.force, 0);
  EXPECT_EQ(law.stiffness, 0);
}

TEST(Contact, pushes_no_farther_in_a_step_than_hair_may_come_out) {
  for (double p = 0.0005; p < 0.08; p += 0.0005) {
    const ContactLaw law = contact_law(0.03, p, p, 1.0 / 50);
    EXPECT_LE(law.force / law.stiffness, std::min(p, kContactRecovery_m_per_s / 50) * (1 + 1e-9))
        << "from " << p << " m";
    EXPECT_GT(law.force, 0);
  }
}

TEST(Contact, what_comes_in_is_stopped_at_the_limit) {
  // The point is 2 mm outside its limit, and its velocity would bring it 3 mm inside. Without any other load, the
  // linear law must end the step just at the limit.
  const ContactLaw law = contact_law(0.03, -0.002, 0.003, 1.0 / 50);
  EXPECT_GT(law.stiffness, 0);
  EXPECT_NEAR(law.force / law.stiffness, -0.002, 1e-12);
}

}  // namespace
}  // namespace hairnet
