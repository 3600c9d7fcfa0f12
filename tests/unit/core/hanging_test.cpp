#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/ffd/deform.hpp"
#include "core/levels/build.hpp"
#include "core/solver/step.hpp"
#include "tests/support/case_name.hpp"
#include "tests/support/levels.hpp"

namespace hairnet {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

// A few straight strands that hang from a root line at the head joint, as a thin lock.
Groom make_lock(float length_m) {
  Groom groom;
  groom.group_names = {"lock"};
  for (int s = 0; s < 9; ++s) {
    const Vec3f root(0.002f * static_cast<float>(s % 3 - 1), 0, 0.002f * static_cast<float>(s / 3 - 1));
    std::vector<Vec3f> strand;
    for (int i = 0; i <= 15; ++i) strand.push_back(root - Vec3f(0, length_m * static_cast<float>(i) / 15, 0));
    groom.add_strand(strand, {.hair_count = 50, .root_length_m = 0});
  }
  return groom;
}

// Returns the lock's direction from root to tip in world space. The head is tilted about Z within two seconds, and then
// hair comes to rest for `settle_s`.
Vec3f direction_after_tilt(const Groom& groom, const Level& level, double tilt_deg, double settle_s = 20) {
  LatticeState state;
  reset_to_rest(level, state);
  StepScratch scratch;
  StepInput input;
  const int tick_count = static_cast<int>((2 + settle_s) / input.step_s);
  for (int tick = 1; tick <= tick_count; ++tick) {
    const double share = std::min(1.0, tick * input.step_s / 2);
    input.from = input.to;
    input.to = rigid_pose(support::turned(share * tilt_deg * kDegree, Vec3::UnitZ()));
    EXPECT_TRUE(step(level, input, {.iterations = 100}, scratch, state));
  }
  std::vector<Vec3f> grid(level.geometry.lattice.node_count()), points(groom.points.size());
  expand_displacements(level.geometry, state.displacement, grid);
  Deformer(groom, level.geometry.lattice, FfdKind::linear).deform(grid, points);
  // Strand 4 is the middle one of the nine.
  const Vec3 lock = (points[groom.strand_begin[5] - 1] - points[groom.strand_begin[4]]).cast<double>();
  return input.to.head().vector(lock).cast<float>();
}

double degrees_from_vertical(const Vec3f& direction) {
  return std::acos(std::clamp(-direction.normalized().y(), -1.0f, 1.0f)) / static_cast<float>(kDegree);
}

class Hanging : public testing::TestWithParam<double> {};

TEST_P(Hanging, a_strand_is_a_pendulum_that_ends_vertical_at_any_tilt) {
  const float length_m = 0.3f;
  const Groom groom = make_lock(length_m);
  const auto level = build_level(groom, kLevelSpecs[0]);
  const Vec3f direction = direction_after_tilt(groom, *level, GetParam());
  // A pendulum ends vertical; the lattice may err by 4 degrees and 5 % of the length.
  EXPECT_LT(degrees_from_vertical(direction), 4) << "points along " << direction.transpose();
  EXPECT_NEAR(direction.norm(), length_m, 0.05f * length_m);
}

INSTANTIATE_TEST_SUITE_P(Tilts, Hanging, testing::Values(15.0, 45.0, 90.0, 180.0), support::CaseName{"_degrees"});

// Hair without gel hangs down from the tilted head. Hair that kept its design entirely would point 45 degrees from
// vertical, as the head does, so gel must end between the two.
TEST(Hanging, more_ether_stiffness_is_gel_that_keeps_the_design) {
  const Groom groom = make_lock(0.3f);
  Groom with_gel = groom;
  with_gel.materials.base.ether_stiffness_per_s2 = 150;
  const auto soft = build_level(groom, kLevelSpecs[0]), gelled = build_level(with_gel, kLevelSpecs[0]);
  const double from_soft = degrees_from_vertical(direction_after_tilt(groom, *soft, 45, 10));
  const double from_gelled = degrees_from_vertical(direction_after_tilt(groom, *gelled, 45, 10));
  EXPECT_GT(from_gelled, from_soft + 20);
  EXPECT_LT(from_gelled, 45);
}

TEST(Hanging, the_built_design_is_the_upright_equilibrium_exactly) {
  const Groom groom = make_lock(0.3f);
  for (const LevelSpec& spec : kLevelSpecs) {
    const auto level = build_level(groom, spec);
    LatticeState state;
    reset_to_rest(*level, state);
    StepScratch scratch;
    for (int tick = 0; tick < 300; ++tick) ASSERT_TRUE(step(*level, {}, {}, scratch, state));
    for (const Vec3f& d : state.displacement) ASSERT_EQ(d, Vec3f(Vec3f::Zero()));
  }
}

}  // namespace
}  // namespace hairnet
