#include "server/tick/tick_clock.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace hairnet::server {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kStart_ns = 123'456'789;

TEST(TickClock, ticks_fall_at_multiples_of_the_period_and_never_drift) {
  // The arguments are the rate in Hz, the greatest number of overdue ticks that still run, and the time of the first
  // tick.
  TickClock clock(30, 3, kStart_ns);
  for (std::uint64_t i = 0; i < 3000; ++i) {
    const std::int64_t due_ns = clock.next_due_ns();
    EXPECT_FALSE(clock.take(due_ns - 1));
    const auto tick = clock.take(due_ns);
    ASSERT_TRUE(tick);
    EXPECT_EQ(tick->tick, i);
    EXPECT_EQ(tick->time_ns, due_ns);
    EXPECT_FALSE(tick->late);
    EXPECT_EQ(tick->skipped, 0u);
  }
  // 3000 ticks at 30 Hz are exactly 100 s, although a period is no whole number of nanoseconds.
  EXPECT_EQ(clock.next_due_ns(), kStart_ns + 100'000 * kMs);
}

TEST(TickClock, a_late_tick_runs_at_once_with_its_own_time) {
  TickClock clock(30, 3, kStart_ns);
  clock.take(kStart_ns);
  // Tick 1 was due after 33.3 ms. It runs 26.7 ms later, which is more than half a period and so counts as late.
  const auto tick = clock.take(kStart_ns + 60 * kMs);
  ASSERT_TRUE(tick);
  EXPECT_EQ(tick->tick, 1u);
  EXPECT_EQ(tick->time_ns, kStart_ns + 33'333'333);
  EXPECT_TRUE(tick->late);
}

TEST(TickClock, a_few_overdue_ticks_all_run) {
  TickClock clock(100, 3, kStart_ns);
  std::vector<std::uint64_t> ran;
  // At 100 Hz the ticks 0 to 3 are due after 35 ms. The newest is due now, and the three others are as many as may be
  // overdue.
  while (const auto tick = clock.take(kStart_ns + 35 * kMs)) {
    EXPECT_EQ(tick->skipped, 0u);
    ran.push_back(tick->tick);
  }
  EXPECT_EQ(ran, (std::vector<std::uint64_t>{0, 1, 2, 3}));
}

TEST(TickClock, many_overdue_ticks_are_skipped_but_the_newest) {
  TickClock clock(100, 3, kStart_ns);
  // The ticks 0 to 100 are due, far more than may be overdue, so only tick 100 runs.
  const auto tick = clock.take(kStart_ns + 1005 * kMs);
  ASSERT_TRUE(tick);
  EXPECT_EQ(tick->tick, 100u);
  EXPECT_EQ(tick->skipped, 100u);
  EXPECT_EQ(tick->time_ns, kStart_ns + 1000 * kMs);
  EXPECT_FALSE(clock.take(kStart_ns + 1005 * kMs));
  EXPECT_EQ(clock.take(kStart_ns + 1010 * kMs)->skipped, 0u);
}

TEST(TickClock, keeps_its_time_over_years) {
  TickClock clock(120, 3, 0);
  const std::int64_t year_ns = 365ll * 24 * 3600 * 1000 * kMs;
  const auto tick = clock.take(3 * year_ns);
  ASSERT_TRUE(tick);
  EXPECT_EQ(tick->time_ns, 3 * year_ns);
  EXPECT_EQ(tick->tick, 3ull * 365 * 24 * 3600 * 120);
}

}  // namespace
}  // namespace hairnet::server
