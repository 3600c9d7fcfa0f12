#include "core/levels/match_response.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <random>

#include "client/assets/made/made.hpp"
#include "core/levels/build.hpp"
#include "tests/support/build_grooms.hpp"
#include "tests/unit/core/level_checks.hpp"

namespace hairnet {
namespace {

// This is more than the springs of any groom here, so that a level built with it merges none.
constexpr std::size_t kAll = 1'000'000;

// Returns `count` of the springs at random, made stiffer so that the sum of their stiffness stays about the same.
Stiffeners part_of(const Stiffeners& all, std::size_t count, unsigned seed) {
  std::vector<std::size_t> order(all.count());
  std::iota(order.begin(), order.end(), 0);
  std::mt19937 random(seed);
  std::ranges::shuffle(order, random);
  const float ratio = static_cast<float>(all.count()) / static_cast<float>(count);
  Stiffeners part;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t s = order[i];
    part.nodes.insert(part.nodes.end(), all.nodes.begin() + all.begin[s], all.nodes.begin() + all.begin[s + 1]);
    part.weights.insert(part.weights.end(), all.weights.begin() + all.begin[s], all.weights.begin() + all.begin[s + 1]);
    part.begin.push_back(static_cast<std::uint32_t>(part.nodes.size()));
    part.stiffness.push_back(ratio * all.stiffness[s]);
    part.damping.push_back(ratio * all.damping[s]);
    part.rest.push_back(all.rest[s]);
  }
  return part;
}

// A level with all springs of 150 strands, from which tests take a part. match_response() must then make the part
// respond as all springs do.
class MatchingResponse : public testing::Test {
 protected:
  std::shared_ptr<const Level> all_ = build_level(support::make_head_of_hair(150), {{6, 6, 6}, kAll, kAll});

  [[nodiscard]] Level with_part(std::size_t count) const {
    Level level = *all_;
    level.springs = part_of(all_->springs, count, 5);
    return level;
  }
  [[nodiscard]] double error_of(const Level& level) const {
    return response_error(all_->springs, all_->attachments, level);
  }
};

TEST_F(MatchingResponse, lessens_the_error_greatly) {
  Level level = with_part(120);
  const double before = error_of(level);
  // The part must err by more than 5 %, or there is little to lessen.
  ASSERT_GT(before, 0.05);
  ASSERT_TRUE(match_response(all_->springs, all_->attachments, level));
  EXPECT_LT(error_of(level), 0.5 * before);
}

TEST_F(MatchingResponse, never_makes_it_worse) {
  // So few springs cannot carry the hair, and the fit may find nothing better. It must then keep what it has.
  for (const std::size_t count : {1, 5, 40}) {
    Level level = with_part(count);
    const double before = error_of(level);
    ASSERT_TRUE(match_response(all_->springs, all_->attachments, level));
    EXPECT_LE(error_of(level), before * (1 + 1e-6));
  }
}

TEST_F(MatchingResponse, keeps_what_makes_a_spring) {
  const Level before = with_part(100);
  Level after = before;
  ASSERT_TRUE(match_response(all_->springs, all_->attachments, after));
  support::expect_valid(after);
  EXPECT_EQ(after.springs.nodes, before.springs.nodes);
  EXPECT_EQ(after.springs.begin, before.springs.begin);
  EXPECT_NE(after.springs.weights, before.springs.weights);
  EXPECT_EQ(after.attachments.weights, before.attachments.weights);
  EXPECT_EQ(after.attachments.stiffness, before.attachments.stiffness);
  for (std::size_t s = 0; s < after.springs.count(); ++s) {
    const float damping_time_s = before.springs.damping[s] / before.springs.stiffness[s];
    // The fit may change a spring's stiffness and weights, but not its damping time and its length, which belong to
    // the hair.
    EXPECT_NEAR(after.springs.damping[s] / after.springs.stiffness[s], damping_time_s, 1e-5f * damping_time_s);
    EXPECT_NEAR(after.springs.rest[s].norm(), before.springs.rest[s].norm(), 1e-5f * before.springs.rest[s].norm());
  }
}

TEST_F(MatchingResponse, leaves_a_model_that_lacks_nothing) {
  Level level = *all_;
  EXPECT_NEAR(error_of(level), 0, 1e-6);
  ASSERT_TRUE(match_response(all_->springs, all_->attachments, level));
  EXPECT_NEAR(error_of(level), 0, 1e-6);
  for (std::size_t e = 0; e < level.springs.weights.size(); ++e) {
    EXPECT_NEAR(level.springs.weights[e], all_->springs.weights[e], 1e-3f);
  }
}

TEST_F(MatchingResponse, gives_the_same_bits_every_time) {
  Level a = with_part(60), b = a;
  ASSERT_TRUE(match_response(all_->springs, all_->attachments, a));
  ASSERT_TRUE(match_response(all_->springs, all_->attachments, b));
  EXPECT_EQ(a.springs.weights, b.springs.weights);
  EXPECT_EQ(a.springs.stiffness, b.springs.stiffness);
}

TEST_F(MatchingResponse, stops_when_told_to) {
  Level level = with_part(60);
  // The callback says stop when a fifth of the work is done.
  EXPECT_FALSE(match_response(all_->springs, all_->attachments, level, [](double share) { return share < 0.2; }));
}

TEST_F(MatchingResponse, a_level_without_springs_stays_as_it_is) {
  Level level = *all_;
  level.springs = {};
  EXPECT_TRUE(match_response(all_->springs, all_->attachments, level));
  EXPECT_EQ(level.springs.count(), 0u);
}

TEST_F(MatchingResponse, a_spring_whose_weights_give_no_direction_is_no_trouble) {
  Level level = with_part(30);
  // A direction is computed from the weighted nodes, and here its length is 0.
  for (std::uint32_t e = 0; e < level.springs.begin[1]; ++e) level.springs.weights[e] = 0;
  EXPECT_TRUE(match_response(all_->springs, all_->attachments, level));
  for (const float w : level.springs.weights) EXPECT_TRUE(std::isfinite(w));
}

TEST(Decimated, made_hair_errs_far_less_than_a_random_part_of_the_springs_made_stiffer) {
  HairstyleOptions options;
  options.strand_count = 400;
  const auto groom = make_hairstyle("long_straight", options);
  ASSERT_TRUE(groom) << groom.error();
  const LevelSpec spec{{7, 7, 7}, 200, 50};
  const auto all = build_level(*groom, {spec.dims, kAll, kAll});
  const auto merged = build_level(*groom, spec);
  // The mean of five random parts, so that one lucky part does not decide.
  double random = 0;
  for (unsigned seed = 0; seed < 5; ++seed) {
    Level level = *all;
    level.springs = part_of(all->springs, spec.spring_count, 2 * seed);
    level.attachments = part_of(all->attachments, spec.attachment_count, 2 * seed + 1);
    random += response_error(all->springs, all->attachments, level) / 5;
  }
  // Merging of similar springs must keep far more than leaving out springs does, or it would not be worth its cost.
  EXPECT_LT(response_error(all->springs, all->attachments, *merged), 0.4 * random);
}

}  // namespace
}  // namespace hairnet
