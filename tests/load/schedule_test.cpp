#include "tests/load/schedule.hpp"

#include <gmock/gmock.h>

#include <map>
#include <set>

namespace hairnet::load {
namespace {

// Makes a plan of stages in the words of --stage. A stage takes from the one before what it does not name.
Plan plan_of(const std::vector<std::string>& stages, std::uint64_t seed = 1) {
  Plan plan;
  plan.seed = seed;
  for (const std::string& text : stages)
    plan.stages.push_back(parse_stage(text, plan.stages.empty() ? nullptr : &plan.stages.back()).value());
  EXPECT_EQ(settle(plan), "");
  return plan;
}

std::size_t count(const std::vector<Action>& schedule, Action::Kind kind) {
  return static_cast<std::size_t>(std::ranges::count(schedule, kind, &Action::kind));
}

// Counts the well-behaved clients that have joined and not left by `time_s`.
std::size_t population(const std::vector<Action>& schedule, double time_s) {
  std::set<std::uint32_t> there;
  for (const Action& action : schedule) {
    if (static_cast<double>(action.at_ns) > time_s * 1e9) break;
    if (action.kind == Action::Kind::join && !action.misbehaviour) there.insert(action.client);
    if (action.kind == Action::Kind::leave || action.kind == Action::Kind::vanish) there.erase(action.client);
  }
  return there.size();
}

TEST(Schedule, ramps_evenly_then_stays_and_goes_down_again) {
  const auto schedule =
      make_schedule(plan_of({"ramp:10s:clients=100", "steady:10s", "ramp:10s:clients=20", "steady:1s"}));
  EXPECT_EQ(population(schedule, 0), 0u);
  EXPECT_NEAR(static_cast<double>(population(schedule, 5)), 50, 1);
  EXPECT_EQ(population(schedule, 10), 100u);
  EXPECT_EQ(population(schedule, 19.9), 100u);
  EXPECT_NEAR(static_cast<double>(population(schedule, 25)), 60, 1);
  EXPECT_EQ(population(schedule, 30.5), 20u);
}

TEST(Schedule, spike_comes_at_once) {
  const auto schedule = make_schedule(plan_of({"steady:5s:clients=10", "spike:5s:clients=60"}));
  EXPECT_EQ(population(schedule, 4.99), 10u);
  // All 50 new clients join within 30 ms of the stage's beginning.
  EXPECT_EQ(population(schedule, 5.03), 60u);
}

TEST(Schedule, the_same_seed_repeats_and_another_does_not) {
  const std::vector<std::string> stages{"ramp:2s:clients=20,slow=2", "steady:20s:churn=3,storm=50%"};
  EXPECT_EQ(make_schedule(plan_of(stages)), make_schedule(plan_of(stages)));
  EXPECT_NE(make_schedule(plan_of(stages)), make_schedule(plan_of(stages, 2)));
}

TEST(Schedule, churn_keeps_the_population_and_its_rate) {
  const auto schedule = make_schedule(plan_of({"ramp:1s:clients=50", "steady:1000s:churn=2"}));
  for (const double time_s : {10.0, 500.0, 999.0}) EXPECT_EQ(population(schedule, time_s), 50u) << time_s;
  const double left = static_cast<double>(count(schedule, Action::Kind::leave) + count(schedule, Action::Kind::vanish));
  // Departures are Poisson with a mean of 2 Hz x 1000 s. The bound is five standard deviations.
  EXPECT_NEAR(left, 2000, 5 * std::sqrt(2000.0));
  // Both ways to go, with a goodbye and without one, must be common.
  EXPECT_GT(count(schedule, Action::Kind::leave), left / 3);
  EXPECT_GT(count(schedule, Action::Kind::vanish), left / 3);
}

TEST(Schedule, no_client_leaves_before_it_comes) {
  const auto schedule = make_schedule(
      plan_of({"steady:4s:clients=30,churn=50,storm=1", "spike:2s:clients=5,churn=20", "ramp:3s:clients=40"}));
  std::set<std::uint32_t> there;
  for (const Action& action : schedule) {
    if (action.kind == Action::Kind::join) {
      EXPECT_TRUE(there.insert(action.client).second);
    } else if (action.kind == Action::Kind::leave || action.kind == Action::Kind::vanish) {
      EXPECT_EQ(there.erase(action.client), 1u) << action.client;
    }
  }
}

TEST(Schedule, reconnect_storm_takes_each_client_of_its_share_once) {
  const auto schedule = make_schedule(plan_of({"ramp:1s:clients=40", "steady:10s:storm=25%"}));
  std::set<std::uint32_t> lost;
  for (const Action& action : schedule) {
    if (action.kind != Action::Kind::lose_connection) continue;
    // A storm comes in the middle of its stage: at 1 s + 10 s / 2.
    EXPECT_EQ(action.at_ns, 6'000'000'000);
    lost.insert(action.client);
  }
  EXPECT_EQ(lost.size(), 10u);
}

TEST(Schedule, misbehaving_clients_come_beside_other_clients_and_go) {
  const auto schedule = make_schedule(plan_of({"steady:2s:clients=20,slow=10%,flood=3", "steady:2s:slow=0,flood=0"}));
  std::map<Misbehaviour, int> joined;
  for (const Action& action : schedule)
    if (action.kind == Action::Kind::join && action.misbehaviour) ++joined[*action.misbehaviour];
  EXPECT_EQ(joined[Misbehaviour::slow], 2);
  EXPECT_EQ(joined[Misbehaviour::flood], 3);
  EXPECT_EQ(population(schedule, 1.9), 20u);
  // The two slow and three flooding clients leave, because the second stage has none.
  EXPECT_EQ(count(schedule, Action::Kind::leave) + count(schedule, Action::Kind::vanish), 5u);
}

TEST(Schedule, characters_of_present_clients_change_with_the_stage) {
  const auto schedule = make_schedule(plan_of({"steady:2s:clients=3,characters=1", "steady:2s:characters=5"}));
  ASSERT_EQ(count(schedule, Action::Kind::set_characters), 3u);
  for (const Action& action : schedule) {
    if (action.kind == Action::Kind::set_characters) {
      EXPECT_EQ(action.characters, 5u);
    }
  }
}

}  // namespace
}  // namespace hairnet::load
