#include "server/grooms/learning_turns.hpp"

#include <gtest/gtest.h>

#include <new>

#include "core/modes/make_modes.hpp"
#include "schema/wire/groom_file.hpp"

namespace hairnet::server {
namespace {

// Four grooms in memory: with one user, with two, without any, and one that has learnt hair already.
struct LearningTurnsTest : testing::Test {
  static constexpr wire::GroomHash kOneUser{1}, kTwoUsers{2}, kUnused{3}, kLearnt{4};
  static std::size_t user_count(const wire::GroomHash& groom) {
    return groom == kTwoUsers ? 2 : groom == kUnused ? 0 : 1;
  }
  LearningTurns turns(Learning when) {
    LearningTurns made(when, counters_);
    made.learn_with(learner_, [this] { return is_short_; });
    for (const wire::GroomHash& groom : {kOneUser, kTwoUsers, kUnused}) made.add(groom, false);
    made.add(kLearnt, true);
    return made;
  }
  GroomCounters counters_;
  HairLearner learner_{HairLearnerDef{}};
  bool is_short_ = true;
};

TEST_F(LearningTurnsTest, the_groom_with_most_users_is_first_and_each_has_one_turn) {
  LearningTurns learning = turns(Learning::always);
  EXPECT_EQ(learning.next(user_count, 0), kTwoUsers);
  EXPECT_EQ(learning.next(user_count, 0), kOneUser);
  EXPECT_EQ(learning.next(user_count, 0), std::nullopt);
}

TEST_F(LearningTurnsTest, nothing_is_learnt_until_time_has_been_short_for_a_while) {
  LearningTurns learning = turns(Learning::when_short);
  EXPECT_EQ(learning.next(user_count, 0), std::nullopt);
  is_short_ = false;
  // Time must be short for 5 s without a break (kShortFor_ns in learning_turns.cpp): here it is at 0 s, not at 4 s, and
  // again from 5 s to 10 s.
  EXPECT_EQ(learning.next(user_count, 4'000'000'000), std::nullopt);
  is_short_ = true;
  EXPECT_EQ(learning.next(user_count, 5'000'000'000), std::nullopt);
  EXPECT_EQ(learning.next(user_count, 10'000'000'000), kTwoUsers);
}

TEST_F(LearningTurnsTest, nothing_is_learnt_when_the_operator_forbids_it) {
  LearningTurns learning = turns(Learning::never);
  EXPECT_EQ(learning.next(user_count, 0), std::nullopt);
  EXPECT_EQ(learning.next(user_count, 60'000'000'000), std::nullopt);
}

TEST_F(LearningTurnsTest, a_groom_that_has_left_memory_has_no_turn) {
  LearningTurns learning = turns(Learning::always);
  learning.erase(kTwoUsers);
  EXPECT_EQ(learning.next(user_count, 0), kOneUser);
}

TEST_F(LearningTurnsTest, hair_that_found_no_memory_is_tried_again_after_a_pause) {
  HairLearnerDef def;
  def.learn = [](const Groom&, const std::shared_ptr<const LevelSet>&,
                 const BuildCallbacks&) -> Result<std::shared_ptr<const LearntHair>> { throw std::bad_alloc(); };
  HairLearner without_memory(def);
  LearningTurns learning = turns(Learning::always);
  learning.learn_with(without_memory, [] { return true; });
  ASSERT_EQ(learning.next(user_count, 0), kTwoUsers);
  auto levels = std::make_shared<LevelSet>();
  levels->modes = std::make_shared<const Modes>();
  const auto file = std::make_shared<const std::vector<std::uint8_t>>(wire::encode_groom(Groom()));
  learning.begin({kTwoUsers, levels, file});
  ASSERT_TRUE(without_memory.poll());
  LearningResult result;
  EXPECT_FALSE(learning.take(result));
  EXPECT_EQ(counters_.grooms_learnt_refused.value(), 1u);
  // The pause begins at the first call after the failure, which is at 1 s here. So it is not over at kMemoryPause_ns,
  // but a second later.
  EXPECT_EQ(learning.next(user_count, 1'000'000'000), std::nullopt);
  EXPECT_EQ(learning.next(user_count, LearningTurns::kMemoryPause_ns), std::nullopt);
  EXPECT_EQ(learning.next(user_count, 1'000'000'000 + LearningTurns::kMemoryPause_ns), kTwoUsers);
}

}  // namespace
}  // namespace hairnet::server
