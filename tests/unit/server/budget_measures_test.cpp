#include <gtest/gtest.h>

#include <cmath>

#include "core/random.hpp"
#include "server/tick/budget_guard.hpp"
#include "server/tick/cost_estimate.hpp"

namespace hairnet::server {
namespace {

constexpr double kTick_s = 1.0 / 30;

// Makes the costs of a tick in which `count` characters each took `turn_s`.
StepCosts costs_of(LevelIndex level, int stride, double turn_s, std::uint32_t count) {
  StepCosts costs;
  costs.of(level, stride) = {static_cast<std::int64_t>(1e9 * turn_s * count), count};
  return costs;
}

TEST(CostEstimate, begins_with_a_finer_level_costing_more_and_a_stride_less_a_tick) {
  const CostEstimate cost(kTick_s);
  for (const int stride : {1, 2, 4}) {
    EXPECT_GT(cost.turn_s(LevelIndex::high, stride), cost.turn_s(LevelIndex::medium, stride));
    EXPECT_GT(cost.turn_s(LevelIndex::medium, stride), cost.turn_s(LevelIndex::low, stride));
    EXPECT_GT(cost.turn_s(LevelIndex::low, stride), cost.turn_s(LevelIndex::ether, stride));
    EXPECT_EQ(cost.turn_s(LevelIndex::rigid, stride), 0);
  }
  for (const LevelIndex level : {LevelIndex::high, LevelIndex::medium, LevelIndex::low, LevelIndex::ether}) {
    // A turn over two ticks costs more than one over a single tick, but less for each tick that it covers.
    EXPECT_LT(cost.turn_s(level, 2) / 2, 0.6 * cost.turn_s(level, 1));
    EXPECT_LT(cost.turn_s(level, 4) / 4, 0.4 * cost.turn_s(level, 1));
  }
}

// The first sample replaces the table's value. Later ones have a weight of 0.1 (kGain in cost_estimate.cpp), so 60
// ticks leave less than 1 % of a change.
TEST(CostEstimate, comes_to_what_is_measured) {
  CostEstimate cost(kTick_s);
  for (int tick = 0; tick < 10; ++tick) cost.observe(costs_of(LevelIndex::low, 1, 30e-6, 100));
  EXPECT_NEAR(cost.turn_s(LevelIndex::low, 1), 30e-6, 1e-6);
  for (int tick = 0; tick < 60; ++tick) cost.observe(costs_of(LevelIndex::low, 1, 60e-6, 100));
  EXPECT_NEAR(cost.turn_s(LevelIndex::low, 1), 60e-6, 2e-6);
}

// Only low hair is measured, on a machine five times as slow as the table's. Without the common factor of the machine,
// the first characters at the high level would take five times what the budget expects.
TEST(CostEstimate, takes_a_slow_machine_for_slow_on_levels_not_measured_too) {
  const CostEstimate table(kTick_s);
  CostEstimate cost(kTick_s);
  for (int tick = 0; tick < 100; ++tick) {
    cost.observe(costs_of(LevelIndex::low, 1, 5 * table.turn_s(LevelIndex::low, 1), 100));
  }
  EXPECT_NEAR(cost.turn_s(LevelIndex::high, 2) / table.turn_s(LevelIndex::high, 2), 5, 0.5);
}

// One tick in ten takes a hundred times as long, as when another program runs. A sample counts at most twice the
// estimate (kSampleMax), so it may pull the mean by some percent only.
TEST(CostEstimate, is_hardly_pulled_by_one_tick_in_ten) {
  CostEstimate cost(kTick_s);
  for (int tick = 0; tick < 300; ++tick) {
    cost.observe(costs_of(LevelIndex::high, 1, tick % 10 == 9 ? 5e-3 : 50e-6, 40));
    EXPECT_LT(cost.turn_s(LevelIndex::high, 1), 1.15 * 50e-6);
    EXPECT_GT(cost.turn_s(LevelIndex::high, 1), 0.95 * 50e-6);
  }
}

TEST(CostEstimate, ignores_what_was_not_timed) {
  const CostEstimate table(kTick_s);
  CostEstimate cost(kTick_s);
  cost.observe(costs_of(LevelIndex::high, 1, 0, 40));
  cost.observe({});
  EXPECT_EQ(cost.turn_s(LevelIndex::high, 1), table.turn_s(LevelIndex::high, 1));
}

// Work may take 0.7 of a tick, the default of --tick-budget.
TickGuardDef def_of(int workers = 1) {
  return {.tick_s = kTick_s, .tick_share = 0.7, .workers = workers};
}

TEST(TickGuard, gives_the_share_of_every_worker_at_first) {
  EXPECT_NEAR(TickGuard(def_of(4)).available_s(), 4 * 0.7 * kTick_s, 1e-12);
}

// Observes a tick of one worker that does nothing but work on characters. Wanted work is 0 s, so there is no safety
// margin.
void take(TickGuard& guard, double tick_duration_s) {
  guard.observe(tick_duration_s, tick_duration_s, 0);
}

TEST(TickGuard, cuts_within_a_few_ticks_until_ticks_fit) {
  TickGuard guard(def_of());
  // Work takes this many times the predicted time.
  const double truth = 3;
  int ticks = 0;
  for (; ticks < 100 && truth * guard.available_s() > 0.7 * kTick_s; ++ticks) take(guard, truth * guard.available_s());
  // Each cut needs two ticks beyond the share and halves the trust at most (kCutMax), so a third of it takes two cuts;
  // eight ticks leave some room.
  EXPECT_LE(ticks, 8);
  EXPECT_GT(guard.available_s(), 0.1 * 0.7 * kTick_s) << "no deeper than needed";
}

TEST(TickGuard, takes_one_late_tick_for_an_accident) {
  TickGuard guard(def_of());
  const double before_s = guard.available_s();
  take(guard, 5 * kTick_s);
  for (int tick = 0; tick < 3; ++tick) take(guard, 0.3 * kTick_s);
  EXPECT_EQ(guard.available_s(), before_s);
}

TEST(TickGuard, gives_back_the_faster_the_more_room_there_is) {
  for (const double used : {0.1, 0.5}) {
    TickGuard guard(def_of());
    for (int tick = 0; tick < 4; ++tick) take(guard, 3 * kTick_s);
    const double cut_s = guard.available_s();
    for (int tick = 0; tick < 15; ++tick) take(guard, used * 0.7 * kTick_s);
    // Half a second passes. The trust recovers at a rate of 2.5 a second (kReturnPerS), times the distance of a tick
    // below 0.85 of the share (kCalm).
    EXPECT_NEAR(guard.available_s() / cut_s, std::exp(0.5 * 2.5 * (0.85 - used)), 0.1);
  }
}

TEST(TickGuard, settles) {
  TickGuard guard(def_of());
  // Work takes twice as long as predicted. The guard neither cuts nor gives back while ticks take 0.85 (kCalm) to 1 of
  // the share, so it must come to rest there and stay for a minute.
  for (int tick = 0; tick < 30 * 120; ++tick) take(guard, 2 * guard.available_s());
  const double settled_s = guard.available_s();
  for (int tick = 0; tick < 30 * 60; ++tick) take(guard, 2 * guard.available_s());
  EXPECT_NEAR(guard.available_s(), settled_s, 0.001 * settled_s);
  EXPECT_LE(2 * settled_s, 0.7 * kTick_s);
  EXPECT_GE(2 * settled_s, 0.8 * 0.7 * kTick_s);
}

// Two workers are busy for 0.2 of a tick with other things than characters. This overhead is subtracted from their
// share, and one late tick must not count as overhead: a sample is at most twice the mean and has a weight of 0.1
// (kOverheadGain in budget_guard.cpp).
TEST(TickGuard, takes_off_what_ticks_take_beside_the_work) {
  TickGuard guard(def_of(2));
  const double work_s = 0.3 * kTick_s, overhead_s = 0.2 * kTick_s;
  for (int tick = 0; tick < 60; ++tick) guard.observe((work_s + overhead_s) / 2, work_s, 0);
  EXPECT_NEAR(guard.available_s(), (2 * 0.7 - 0.2) * kTick_s, 0.002 * kTick_s);
  guard.observe(5 * kTick_s, work_s, 0);
  EXPECT_GT(guard.available_s(), (2 * 0.7 - 0.23) * kTick_s) << "by one accident hardly more";
  for (int tick = 0; tick < 30; ++tick) guard.observe(work_s / 2, work_s, 0);
  EXPECT_NEAR(guard.available_s(), 2 * 0.7 * kTick_s, 0.02 * kTick_s) << "and within a second no longer";
}

// Runs ten minutes in which other programs of the machine stretch one tick in fifty, to twice its time at most. Returns
// the share of ticks that took longer than a tick may.
double overrun_share(TickGuard& guard, double wanted_s, Random& random) {
  int overruns = 0;
  constexpr int kTicks = 18'000;
  for (int tick = 0; tick < kTicks; ++tick) {
    const double stretched = random.unit() < 0.02 ? 1 + random.unit() : 1;
    const double tick_s = guard.available_s() * stretched;
    overruns += tick_s > kTick_s;
    guard.observe(tick_s, guard.available_s(), wanted_s);
  }
  return static_cast<double>(overruns) / kTicks;
}

TEST(TickGuard, keeps_a_margin_against_noise_where_more_is_wanted_than_there_is) {
  Random random(1, 1);
  TickGuard without(def_of()), with(def_of());
  EXPECT_GT(overrun_share(without, 0.1 * kTick_s, random), 0.003) << "what is wanted comes first";
  // The margin comes to rest at one overrun in 2000 ticks (kMarginStep and kMarginReturn in budget_guard.cpp); the
  // limit is twice this share.
  EXPECT_LT(overrun_share(with, 4 * kTick_s, random), 0.001);
  const double drawn_in_s = with.available_s();
  with.observe(drawn_in_s, drawn_in_s, 0.1 * kTick_s);
  EXPECT_GT(with.available_s(), 1.1 * drawn_in_s) << "and is none as soon as it fits";
}

// Without any time no character would be stepped, and nothing could be measured any more. Ten minutes of idle ticks
// must not give more than the share.
TEST(TickGuard, never_gives_nothing_nor_more_than_the_share) {
  TickGuard guard(def_of());
  for (int tick = 0; tick < 1000; ++tick) guard.observe(100 * kTick_s, 0, 0);
  EXPECT_GT(guard.available_s(), 0);
  for (int tick = 0; tick < 30 * 600; ++tick) guard.observe(0, 0, 0);
  EXPECT_NEAR(guard.available_s(), 0.7 * kTick_s, 1e-12);
}

}  // namespace
}  // namespace hairnet::server
