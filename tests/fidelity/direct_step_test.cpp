#include "tests/fidelity/direct_step.hpp"

#include <gtest/gtest.h>

#include "core/levels/build.hpp"
#include "tests/support/build_grooms.hpp"
#include "tests/support/case_name.hpp"

namespace hairnet::fidelity {
namespace {

struct Case {
  const char* name;
  LevelSpec spec;
  // The head turns by it in the step.
  double turn_rad;

  friend void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }
};

class DirectSteps : public testing::TestWithParam<Case> {};

// The lattice starts away from rest, in contact with the metaballs of a body and in wind, so that every force acts.
TEST_P(DirectSteps, are_those_of_the_reference) {
  Groom groom = support::make_head_of_hair(60);
  groom.body = support::make_plain_body();
  const auto level = build_level(groom, GetParam().spec);
  ASSERT_GT(level->springs.count(), 0u);
  LatticeState state;
  reset_to_rest(*level, state);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> range(-1, 1);
  for (std::size_t i = 0; i < level->rest.size(); ++i) {
    for (int a = 0; a < 3; ++a) {
      state.displacement[i][a] = 0.01f * range(random);
      state.velocity[i][a] = 0.3f * range(random);
    }
  }
  StepInput input;
  input.from = rigid_pose({Quat(Eigen::AngleAxisd(0.4, Vec3(1, 2, 0.5).normalized())), Vec3(0.3, 1.6, -2)});
  input.to = input.from;
  for (RigidTransform& bone : input.to.bones) {
    bone.rotation = Quat(Eigen::AngleAxisd(GetParam().turn_rad, Vec3(0.2, 1, 0.1).normalized())) * bone.rotation;
    bone.position += Vec3(0.02, 0.01, -0.03);
  }
  input.step_s = 1.0 / 25;
  const Environment windy{.wind = WindField({.mean_m_per_s = {2, 0, 1}})};
  input.environment = &windy;
  input.contact_release = 0.4;

  WorldLattice expected = to_world(*level, input.from.head(), state), direct = expected;
  const WorldLattice before = expected;
  // The reference iterates until the relative residual is near the precision of a double, so that its own error is
  // far below the bound of 1e-8.
  reference_step(*level, input, expected, 1e-13);
  DirectStep solver(*level);
  ASSERT_TRUE(solver.step(input, direct));
  double moved = 0, error = 0;
  for (std::size_t i = 0; i < level->rest.size(); ++i) {
    moved = std::max(moved, (expected.P_dot[i] - before.P_dot[i]).norm());
    error = std::max(error, (direct.P_dot[i] - expected.P_dot[i]).norm());
    EXPECT_NEAR((direct.P[i] - expected.P[i]).norm(), 0, 1e-9);
  }
  // The velocities must change much, in m/s, or equal results would prove little.
  EXPECT_GT(moved, 0.1);
  EXPECT_LT(error, 1e-8 * moved);
}

INSTANTIATE_TEST_SUITE_P(Models, DirectSteps,
                         // The counts of springs and attachments are upper limits. 100 000 are more than the groom
                         // has, so none is left out.
                         testing::Values(Case{"all_springs", {{6, 6, 6}, 100'000, 100'000}, 0.1},
                                         Case{"few_springs", {{6, 6, 6}, 50, 10}, 0.1},
                                         Case{"steady_head", {{4, 5, 6}, 100, 20}, 0}),
                         support::CaseName());

}  // namespace
}  // namespace hairnet::fidelity
