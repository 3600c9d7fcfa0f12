#include <gtest/gtest.h>

#include "core/solver/reference_step.hpp"
#include "tests/bench/step_runner.hpp"
#include "tests/support/case_name.hpp"
#include "tests/support/levels.hpp"

namespace hairnet::bench {
namespace {

using support::make_random_level;
using support::make_random_state;
using support::turned;

constexpr double kFrame_s = 1.0 / 25;

Pose moved(double yaw_rad, const Vec3& position, double shoulder_rad = 0) {
  Pose pose = rigid_pose(turned(yaw_rad, {0.3, 1, 0.2}, position));
  pose[Bone::left_shoulder] = turned(shoulder_rad, {0, 0, 1}, position + Vec3(0.01, 0.005, 0));
  return pose;
}

// Makes four characters with one frame each. Their lattices are crumpled: each coordinate of a node is up to 2 cm from
// its design and moves at up to 0.5 m/s. In the frame the head turns by 0.08 rad and moves by 4 cm, and the left
// shoulder turns by 0.2 rad.
Workload random_cast(const Level& level) {
  Workload cast{kFrame_s, 1, {}};
  for (unsigned seed = 1; seed <= 4; ++seed) {
    BenchCharacter character{make_random_state(level, 0.02f, 0.5f, seed), {}};
    character.poses = {moved(0.1 * seed, {0.5, 1.5, -2.0 * seed}),
                       moved(0.1 * seed + 0.08, {0.52, 1.49, -2.0 * seed + 0.03}, 0.2)};
    cast.characters.push_back(character);
  }
  return cast;
}

class Baselines : public testing::TestWithParam<support::Named<Baseline>> {};

// The benchmark compares our kernels with the baselines. A baseline with wrong forces could be faster or slower than
// the paper's method, so each must make the same step as reference_step.
TEST_P(Baselines, agree_with_the_reference_when_their_solver_converges) {
  const Level level = make_random_level();
  const Workload cast = random_cast(level);
  const auto performer = make_baseline(GetParam().value, level, cast,
                                       {.iterations = 4000, .steps_per_frame = 1, .relative_residual = 1e-12});
  performer->rewind();
  ASSERT_TRUE(performer->perform());
  const std::vector<LatticeState> states = performer->states();
  for (std::size_t c = 0; c < cast.characters.size(); ++c) {
    // The first frame, as one step.
    const StepInput input = step_input(cast, cast.characters[c], 0, 0, 1);
    WorldLattice reference = to_world(level, input.from.head(), cast.characters[c].state);
    const WorldLattice before = reference;
    reference_step(level, input, reference, 1e-12);
    const LatticeState expected = to_head(level, input.to.head(), reference);
    double moved_m = 0;
    for (std::size_t i = 0; i < level.rest.size(); ++i) {
      moved_m = std::max(moved_m, (reference.P[i] - before.P[i]).norm());
      // The baselines work in double. The states are floats, whose rounding the bounds allow.
      EXPECT_LT((states[c].displacement[i] - expected.displacement[i]).norm(), 1e-7f);
      EXPECT_LT((states[c].velocity[i] - expected.velocity[i]).norm(), 1e-6f);
    }
    // A step that moves no node by a centimetre would agree too easily.
    EXPECT_GT(moved_m, 0.01);
  }
}

// A baseline that ignored its number of iterations, or did not go back to the same state, would be timed for other
// work.
TEST_P(Baselines, stop_at_their_iterations) {
  const Level level = make_random_level();
  const Workload cast = random_cast(level);
  const auto few = make_baseline(GetParam().value, level, cast, {.iterations = 2});
  const auto more = make_baseline(GetParam().value, level, cast, {.iterations = 3});
  few->rewind();
  more->rewind();
  ASSERT_TRUE(few->perform() && more->perform());
  EXPECT_NE(few->hash(), more->hash());
  const std::string hash = few->hash();
  few->rewind();
  EXPECT_NE(few->hash(), hash);
  ASSERT_TRUE(few->perform());
  EXPECT_EQ(few->hash(), hash);
}

TEST_P(Baselines, take_what_is_not_finite_for_a_failure) {
  const Level level = make_random_level();
  Workload cast = random_cast(level);
  cast.characters[1].state.velocity[3].x() = std::numeric_limits<float>::quiet_NaN();
  const auto performer = make_baseline(GetParam().value, level, cast, {});
  performer->rewind();
  EXPECT_FALSE(performer->perform());
}

INSTANTIATE_TEST_SUITE_P(All, Baselines,
                         testing::Values(support::Named{"naive", Baseline::naive},
                                         support::Named{"fair", Baseline::fair}),
                         support::CaseName());

// The kernels of a crowd step several characters at once, where a single character is stepped alone.
TEST(Performers, crowd_and_single_give_the_same_bits) {
  const Level level = make_random_level();
  const Workload cast = random_cast(level);
  for (const int iterations : {3, 12}) {
    const auto single = make_single(level, cast, {.iterations = iterations, .steps_per_frame = 2});
    const auto crowd = make_crowd(level, cast, {.iterations = iterations, .steps_per_frame = 2});
    single->rewind();
    crowd->rewind();
    ASSERT_TRUE(single->perform() && crowd->perform());
    EXPECT_EQ(single->hash(), crowd->hash());
  }
}

}  // namespace
}  // namespace hairnet::bench
