#include "client/link/backoff.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace hairnet::link {
namespace {

TEST(Backoff, waits_are_spread_over_as_long_as_it_has_been_away) {
  std::vector<double> shares;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    Backoff backoff(seed);
    // Each of 100 clients makes ten attempts, one second apart. The bound of a wait grows with the outage up to
    // kBoundMax_ns, 5 s.
    for (std::int64_t away_ns = 0; away_ns < 2 * Backoff::kBoundMax_ns; away_ns += 1'000'000'000) {
      const std::int64_t bound_ns = std::clamp(away_ns, Backoff::kBoundMin_ns, Backoff::kBoundMax_ns);
      const std::int64_t wait_ns = backoff.next_ns(away_ns);
      EXPECT_GE(wait_ns, 0);
      EXPECT_LE(wait_ns, bound_ns);
      shares.push_back(static_cast<double>(wait_ns) / static_cast<double>(bound_ns));
    }
  }
  double mean = 0;
  for (const double share : shares) mean += share / static_cast<double>(shares.size());
  // The 1000 shares must be spread evenly over 0 to 1.
  EXPECT_NEAR(mean, 0.5, 0.05);
  EXPECT_LT(*std::min_element(shares.begin(), shares.end()), 0.02);
  EXPECT_GT(*std::max_element(shares.begin(), shares.end()), 0.98);
}

TEST(Backoff, client_is_back_within_twice_the_time_that_the_server_was_away) {
  for (std::uint64_t seed = 0; seed < 1000; ++seed) {
    Backoff backoff(seed);
    // The server is away for 50 ms, 0.4 s or 1.4 s, and each client tries again after each wait.
    for (const std::int64_t away_ns : {50'000'000, 400'000'000, 1'400'000'000}) {
      std::int64_t at_ns = 0;
      while (at_ns < away_ns) at_ns += backoff.next_ns(at_ns);
      EXPECT_LE(at_ns, 2 * away_ns + Backoff::kBoundMin_ns);
    }
  }
}

TEST(Backoff, the_same_seed_waits_the_same) {
  Backoff a(9), b(9), c(10);
  bool differs = false;
  for (int i = 0; i < 10; ++i) {
    const std::int64_t away_ns = std::int64_t{i} * 1'000'000'000, wait_ns = a.next_ns(away_ns);
    EXPECT_EQ(wait_ns, b.next_ns(away_ns));
    differs |= wait_ns != c.next_ns(away_ns);
  }
  EXPECT_TRUE(differs);
}

}  // namespace
}  // namespace hairnet::link
