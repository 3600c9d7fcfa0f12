#include "core/solver/crowd_step.hpp"

#include <gtest/gtest.h>

#include <hwy/highway.h>
#include <bit>
#include <random>

#include "core/solver/reference_step.hpp"
#include "tests/support/case_name.hpp"
#include "tests/support/levels.hpp"

namespace hairnet {
namespace {

using support::make_random_level;
using support::make_random_state;
using support::turned;

constexpr std::size_t kSubsteps = 2;
constexpr unsigned kSeedMax = 32;

// Characters of one level with poses, materials and winds of their own, for two substeps. Character 2 is at rest.
// Character 4 has more elastic energy than its last step may have left, so that its step must scale the lattice
// down.
struct TestCrowd {
  Level level = make_random_level({.seed = 5});
  std::vector<LatticeState> states;
  std::vector<std::array<StepInput, kSubsteps>> inputs;

  explicit TestCrowd(std::size_t count) {
    for (std::size_t c = 0; c < count; ++c) {
      const auto seed = static_cast<unsigned>(c + 1);
      states.push_back(make_random_state(level, 0.02f, 0.5f, seed));
      if (c == 4) states[c].elastic_energy_max_j = 1e-6f;
      inputs.emplace_back();
      for (std::size_t s = 0; s < kSubsteps; ++s) put_input(seed, s, inputs[c][s]);
      if (c == 2) {
        reset_to_rest(level, states[c]);
        inputs[c].fill({});
      }
    }
  }

  // Lives as long as the program, as inputs only point to it.
  static const Environment& environment_of(unsigned seed) {
    static const std::vector<Environment> environments = [] {
      std::vector<Environment> all(kSeedMax + 1);
      for (unsigned s = 1; s <= kSeedMax; s += 2) all[s].wind = WindField({.mean_m_per_s = {1, 0.2, -0.1 * s}});
      return all;
    }();
    return environments.at(seed);
  }

  static void put_input(unsigned seed, std::size_t substep, StepInput& input) {
    const auto pose_at = [seed](double s) {
      // The places are near the origin, where the reference, which works in world coordinates, rounds least.
      const Vec3 place(0.05 * s, 0, -0.02 * seed);
      Pose pose = rigid_pose(turned(0.1 * seed + 0.1 * s, {0.3, 1, 0.2}, place));
      pose[Bone::left_shoulder] = turned(0.2 * s, {0, 0, 1}, place + Vec3(0.01, 0.005, 0));
      return pose;
    };
    input.from = pose_at(static_cast<double>(substep));
    input.to = pose_at(static_cast<double>(substep) + 1);
    input.step_s = 1.0 / (40 + seed);
    input.contact_release = 0.2 * (seed % 4);
    input.material.stiffness = 0.5f + 0.1f * static_cast<float>(seed);
    input.material.gel_per_s2 = static_cast<float>(seed % 3);
    input.material.density = 0.8f + 0.05f * static_cast<float>(seed);
    input.environment = &environment_of(seed);
  }

  [[nodiscard]] std::vector<LatticeState> alone() const {
    std::vector<LatticeState> result = states;
    StepScratch scratch;
    for (std::size_t c = 0; c < result.size(); ++c) {
      for (const StepInput& input : inputs[c]) EXPECT_TRUE(step(level, input, {}, scratch, result[c]));
    }
    return result;
  }

  // Steps the characters `which` side by side, in this order, and returns their states.
  [[nodiscard]] std::vector<LatticeState> together(const std::vector<std::size_t>& which) const {
    std::vector<LatticeState> result;
    for (const std::size_t c : which) result.push_back(states[c]);
    std::vector<CrowdMember> members;
    for (std::size_t l = 0; l < which.size(); ++l) members.push_back({inputs[which[l]], &result[l]});
    StepScratch scratch;
    step_crowd(level, members, {}, scratch);
    for (const CrowdMember& member : members) EXPECT_TRUE(member.is_finite);
    return result;
  }
};

std::vector<std::uint32_t> bits(const LatticeState& state) {
  std::vector<std::uint32_t> all;
  for (const std::vector<Vec3f>* nodes : {&state.displacement, &state.velocity}) {
    for (const Vec3f& node : *nodes) {
      for (int a = 0; a < 3; ++a) all.push_back(std::bit_cast<std::uint32_t>(node[a]));
    }
  }
  all.push_back(std::bit_cast<std::uint32_t>(state.elastic_energy_max_j));
  all.push_back(std::bit_cast<std::uint32_t>(state.speed_max_m_per_s));
  return all;
}

// Each instruction set that this machine has, and the plain scalar code.
class InstructionSets : public testing::TestWithParam<support::Named<std::int64_t>> {
 protected:
  void SetUp() override { hwy::SetSupportedTargetsForTest(GetParam().value); }
  void TearDown() override { hwy::SetSupportedTargetsForTest(0); }
};

std::vector<support::Named<std::int64_t>> instruction_sets() {
  std::vector<support::Named<std::int64_t>> sets;
  for (std::int64_t left = hwy::SupportedTargets() & HWY_TARGETS; left != 0; left &= left - 1)
    sets.push_back({hwy::TargetName(left & -left), left & -left});
  return sets;
}

TEST_P(InstructionSets, a_character_in_a_crowd_ends_in_the_bits_that_it_ends_in_alone) {
  const TestCrowd cast(crowd_width());
  const std::vector<LatticeState> alone = cast.alone();
  std::vector<std::size_t> all(crowd_width());
  for (std::size_t c = 0; c < all.size(); ++c) all[c] = c;
  const std::vector<LatticeState> together = cast.together(all);
  for (std::size_t c = 0; c < all.size(); ++c) EXPECT_EQ(bits(alone[c]), bits(together[c])) << "character " << c;
}

TEST_P(InstructionSets, neighbours_and_lane_of_a_character_change_no_bit) {
  const TestCrowd cast(8);
  const std::vector<LatticeState> alone = cast.alone();
  // Character 4 has another lane and other neighbours in each of these crowds.
  const std::vector<std::vector<std::size_t>> crowds{{4}, {1, 4}, {7, 0, 4}, {4, 2, 6, 3}};
  for (const auto& crowd : crowds) {
    if (crowd.size() > crowd_width()) continue;
    const std::vector<LatticeState> together = cast.together(crowd);
    for (std::size_t l = 0; l < crowd.size(); ++l) EXPECT_EQ(bits(alone[crowd[l]]), bits(together[l]));
  }
}

TEST_P(InstructionSets, agrees_with_the_double_reference_from_the_same_state) {
  const TestCrowd cast(6);
  StepScratch scratch;
  // Character 2 is at rest, and the reference does not limit elastic energy as the step of character 4 does.
  for (const std::size_t c : {0, 1, 3, 5}) {
    const StepInput& input = cast.inputs[c].front();
    LatticeState state = cast.states[c];
    WorldLattice reference = to_world(cast.level, input.from.head(), state);
    reference_step(cast.level, input, reference, 1e-12);
    const LatticeState expected = to_head(cast.level, input.to.head(), reference);
    ASSERT_TRUE(step(cast.level, input, {.iterations = 400}, scratch, state));
    for (std::size_t i = 0; i < state.displacement.size(); ++i) {
      // The limits are those of the same test in step_test.cpp.
      EXPECT_LT((state.displacement[i] - expected.displacement[i]).norm(), 5e-7f);
      EXPECT_LT((state.velocity[i] - expected.velocity[i]).norm(), 2e-5f);
    }
  }
}

// One character has a NaN. Lanes share every instruction, so it must be shown that no NaN reaches another lane.
TEST_P(InstructionSets, a_broken_state_is_reported_and_harms_no_other_lane) {
  TestCrowd cast(std::min<std::size_t>(crowd_width(), 4));
  const std::vector<LatticeState> alone = cast.alone();
  if (cast.states.size() < 2) GTEST_SKIP() << "these instructions have one lane";
  cast.states[1].velocity[0].x() = std::numeric_limits<float>::quiet_NaN();
  std::vector<CrowdMember> members;
  for (std::size_t c = 0; c < cast.states.size(); ++c) members.push_back({cast.inputs[c], &cast.states[c]});
  StepScratch scratch;
  step_crowd(cast.level, members, {}, scratch);
  for (std::size_t c = 0; c < cast.states.size(); ++c) {
    EXPECT_EQ(members[c].is_finite, c != 1);
    if (c != 1) {
      EXPECT_EQ(bits(alone[c]), bits(cast.states[c]));
    }
  }
}

TEST(CrowdStepDeathTest, more_members_than_lanes_stop_the_program) {
  TestCrowd cast(crowd_width() + 1);
  std::vector<CrowdMember> members;
  for (std::size_t c = 0; c < cast.states.size(); ++c) members.push_back({cast.inputs[c], &cast.states[c]});
  StepScratch scratch;
  EXPECT_DEATH(step_crowd(cast.level, members, {}, scratch), "assertion failed: members.size\\(\\) <= crowd_width");
}

#if HWY_ARCH_X86
// Servers of a fleet have different processors. A recording, or a room that moves, must continue with the same bits.
TEST(InstructionSetsThatFuse, give_the_same_bits_for_any_width) {
  constexpr std::int64_t kFusing = HWY_AVX2 | HWY_AVX3;
  if ((hwy::SupportedTargets() & HWY_TARGETS & kFusing) != kFusing) GTEST_SKIP() << "this machine has not both";
  std::vector<std::vector<LatticeState>> results;
  const std::vector<std::size_t> crowd{0, 1, 2, 3, 4, 5, 6, 7};
  for (const std::int64_t set : {HWY_AVX2, HWY_AVX3}) {
    hwy::SetSupportedTargetsForTest(set);
    results.push_back(TestCrowd(crowd.size()).together(crowd));
  }
  hwy::SetSupportedTargetsForTest(0);
  for (const std::size_t c : crowd) EXPECT_EQ(bits(results[0][c]), bits(results[1][c])) << "character " << c;
}
#endif

INSTANTIATE_TEST_SUITE_P(AllTargets, InstructionSets, testing::ValuesIn(instruction_sets()), support::CaseName());

}  // namespace
}  // namespace hairnet
