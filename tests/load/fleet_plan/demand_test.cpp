#include "tests/load/fleet_plan/demand.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace hairnet::fleet_plan {
namespace {

TEST(FleetPlanDemand, the_busiest_minute_has_as_many_people_as_the_peak) {
  const Settings s;
  const Demand demand(s);
  double most = 0, least = 1e9;
  for (int minute = 0; minute < 1440; ++minute) {
    most = std::max(most, demand.mean_people(minute * 60));
    least = std::min(least, demand.mean_people(minute * 60));
  }
  // Demand scales the curve to the peak, so only rounding errors remain there. The smallest number of people is higher
  // than night_share times the peak, because sessions of 30 minutes on average reach into the quietest minute from
  // busier ones.
  EXPECT_NEAR(most, s.peak, 1e-6 * s.peak);
  EXPECT_NEAR(least / most, s.night_share, 0.05);
}

TEST(FleetPlanDemand, an_even_day_keeps_littles_law) {
  Settings s;
  // The arrival rate is the same at every hour.
  s.night_share = 1;
  const Demand demand(s);
  // Little's law: the mean number of people is the arrival rate times the mean time that each stays.
  EXPECT_NEAR(demand.arrivals_per_s(0) * s.session_min * 60, s.peak, 0.01 * s.peak);
}

TEST(FleetPlanDemand, sessions_are_log_normal_with_the_given_mean) {
  const Settings s;
  const Demand demand(s);
  Random random(5);
  constexpr int kCount = 400'000;
  double sum_s = 0, sum_log = 0, sum_log_2 = 0;
  for (int i = 0; i < kCount; ++i) {
    const double length_s = demand.session_s(random), log = std::log(length_s);
    sum_s += length_s;
    sum_log += log;
    sum_log_2 += log * log;
  }
  const double mean_log = sum_log / kCount, sigma = std::sqrt(sum_log_2 / kCount - mean_log * mean_log);
  // This is the standard deviation of a log-normal variable over its mean. Both bounds below are five standard
  // errors.
  const double relative_deviation = std::sqrt(std::exp(s.session_sigma * s.session_sigma) - 1);
  EXPECT_NEAR(sum_s / kCount, s.session_min * 60, 5 * s.session_min * 60 * relative_deviation / std::sqrt(kCount));
  EXPECT_NEAR(sigma, s.session_sigma, 5 * s.session_sigma / std::sqrt(2.0 * kCount));
}

TEST(FleetPlanDemand, rooms_follow_zipfs_law) {
  Settings s;
  s.rooms = 50;
  s.zipf = 1;
  const Demand demand(s);
  Random random(6);
  constexpr int kCount = 200'000;
  std::vector<int> chosen(s.rooms);
  for (int i = 0; i < kCount; ++i) ++chosen[demand.room(random)];
  double sum = 0;
  for (std::uint32_t room = 0; room < s.rooms; ++room) {
    const double expected = demand.room_share(room) * kCount;
    // The counts are nearly Poisson: the bound is five standard deviations.
    EXPECT_NEAR(chosen[room], expected, 5 * std::sqrt(expected));
    // With an exponent of 1 the room of rank k has the share of the first room over k.
    EXPECT_NEAR(demand.room_share(room) * (room + 1), demand.room_share(0), 1e-9);
    sum += demand.room_share(room);
  }
  EXPECT_NEAR(sum, 1, 1e-12);
}

TEST(FleetPlanDemand, costs_are_the_measured_ones_in_rooms_of_that_size) {
  const ServerCosts costs;
  // The costs were measured in rooms of 8 and 32, and of 4 for learnt hair. Between and beyond these sizes cpu_s and
  // bytes_per_s draw straight lines.
  EXPECT_DOUBLE_EQ(costs.cpu_s(HairLevel::low, 8), costs.low_cpu_8_ms / 1e3);
  EXPECT_DOUBLE_EQ(costs.cpu_s(HairLevel::high, 32), costs.high_cpu_32_ms / 1e3);
  EXPECT_DOUBLE_EQ(costs.bytes_per_s(HairLevel::low, 32), costs.low_32_kb * 1e3);
  EXPECT_DOUBLE_EQ(costs.bytes_per_s(HairLevel::learnt, 4), costs.learnt_4_kb * 1e3);
  // The lines must not cross, also outside the measured sizes: a finer level never costs less.
  for (const double observed : {1.0, 8.0, 32.0, 100.0}) {
    EXPECT_LT(costs.cpu_s(HairLevel::learnt, observed), costs.cpu_s(HairLevel::half_learnt, observed));
    EXPECT_LT(costs.cpu_s(HairLevel::half_learnt, observed), costs.cpu_s(HairLevel::low, observed));
    EXPECT_LT(costs.cpu_s(HairLevel::low, observed), costs.cpu_s(HairLevel::high, observed));
    EXPECT_GT(costs.bytes_per_s(HairLevel::learnt, observed), 0);
  }
}

}  // namespace
}  // namespace hairnet::fleet_plan
