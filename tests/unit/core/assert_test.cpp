#include "core/assert.hpp"

#include <gtest/gtest.h>

#include <string>

namespace hairnet {
namespace {

TEST(AssertDeathTest, a_false_condition_stops_the_program_and_says_where) {
  const int count = 2;
  const std::string next_line = std::to_string(__LINE__ + 1);
  EXPECT_DEATH(HAIRNET_ASSERT(count == 3), "core/assert_test.cpp:" + next_line + ": .*assertion failed: count == 3");
}

TEST(Assert, a_true_condition_is_evaluated_once) {
  int evaluated = 0;
  HAIRNET_ASSERT(++evaluated == 1);
  EXPECT_EQ(evaluated, 1);
}

#ifdef HAIRNET_VALIDATE_ON
TEST(AssertDeathTest, validate_stops_the_program_in_this_build) {
  EXPECT_DEATH(HAIRNET_VALIDATE(1 + 1 == 3), "assertion failed: 1 \\+ 1 == 3");
}
#else
TEST(Assert, validate_is_not_evaluated_in_this_build) {
  int evaluated = 0;
  HAIRNET_VALIDATE(++evaluated == 2);
  EXPECT_EQ(evaluated, 0);
}
#endif

}  // namespace
}  // namespace hairnet
