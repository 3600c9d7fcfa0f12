#include "schema/channel/clock_estimate.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

namespace hairnet::channel {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kSecond = 1000 * kMs;
constexpr std::int64_t kWindow_ns = 10 * kSecond;

TEST(ClockEstimate, knows_nothing_before_the_first_envelope) {
  ClockEstimate clock;
  EXPECT_FALSE(clock.known());
  clock.observe(5, 105);
  ASSERT_TRUE(clock.known());
  EXPECT_EQ(clock.to_local(7), 107);
}

// A peer sends every 33 ms over a path of at least 20 ms, with a jitter of 10 ms on average. The estimate must be the
// smallest delay that has been seen.
TEST(ClockEstimate, keeps_the_least_delay_under_jitter) {
  constexpr std::int64_t kOffset_ns = -1234 * kSecond, kDelayMin_ns = 20 * kMs;
  std::mt19937 random(1);
  // The mean is one over the rate, 10 ms.
  std::exponential_distribution<double> jitter_ms(0.1);
  ClockEstimate clock(kWindow_ns);
  std::int64_t min_seen_ns = std::numeric_limits<std::int64_t>::max();
  std::int64_t arrived_ns = 0;
  for (int n = 0; n < 300; ++n) {
    const std::int64_t sent_ns = n * 33 * kMs;
    const std::int64_t delay_ns = kDelayMin_ns + static_cast<std::int64_t>(jitter_ms(random) * kMs);
    // TCP keeps the order, so no packet arrives before the one sent earlier.
    arrived_ns = std::max(arrived_ns, sent_ns + delay_ns);
    clock.observe(sent_ns - kOffset_ns, arrived_ns);
    min_seen_ns = std::min(min_seen_ns, arrived_ns - sent_ns);
    EXPECT_EQ(clock.to_local(-kOffset_ns), min_seen_ns);
  }
  EXPECT_LT(min_seen_ns, kDelayMin_ns + 2 * kMs);
}

// Compares the estimate with its definition, the least offset of all samples in the window, for random samples.
TEST(ClockEstimate, is_the_minimum_over_the_window) {
  std::mt19937 random(2);
  ClockEstimate clock(kWindow_ns);
  // The time and the offset of each sample.
  std::vector<std::pair<std::int64_t, std::int64_t>> seen;
  std::int64_t now_ns = 0;
  for (int n = 0; n < 3000; ++n) {
    // The estimate merges samples that are less than 1/256 of the window apart (39 ms here), so these are farther
    // apart.
    now_ns += 50 * kMs + static_cast<std::int64_t>(random() % 200) * kMs;
    const std::int64_t offset_ns = static_cast<std::int64_t>(random() % 1000) * kMs;
    clock.observe(now_ns - offset_ns, now_ns);
    seen.emplace_back(now_ns, offset_ns);
    std::int64_t min_ns = offset_ns;
    for (const auto& [at_ns, o] : seen) {
      if (now_ns - at_ns <= kWindow_ns) min_ns = std::min(min_ns, o);
    }
    ASSERT_EQ(clock.to_local(0), min_ns);
  }
}

// Clocks of computers drift by up to some 100 ppm.
TEST(ClockEstimate, follows_drift_either_way) {
  for (const double drift : {-100e-6, 100e-6}) {
    ClockEstimate clock(kWindow_ns);
    double error_ns_max = 0;
    for (std::int64_t now_ns = 0; now_ns < 600 * kSecond; now_ns += 33 * kMs) {
      const auto peer_ns = static_cast<std::int64_t>(static_cast<double>(now_ns) * (1 + drift));
      clock.observe(peer_ns, now_ns);
      error_ns_max = std::max(error_ns_max, std::abs(static_cast<double>(clock.to_local(peer_ns) - now_ns)));
    }
    // A minimum over a window may lag by the drift within one window.
    EXPECT_LE(error_ns_max, 1.01 * std::abs(drift) * static_cast<double>(kWindow_ns)) << drift;
  }
}

TEST(ClockEstimate, recovers_within_a_window_when_the_path_gets_slower) {
  ClockEstimate clock(kWindow_ns);
  clock.observe(0, 10 * kMs);
  std::int64_t now_ns = 0;
  for (; now_ns < 2 * kWindow_ns; now_ns += 100 * kMs) clock.observe(now_ns - 50 * kMs, now_ns);
  EXPECT_EQ(clock.to_local(0), 50 * kMs);
}

TEST(ClockEstimate, stays_known_after_a_silence_longer_than_the_window) {
  ClockEstimate clock(kWindow_ns);
  clock.observe(0, 10);
  clock.observe(5 * kWindow_ns, 5 * kWindow_ns + 30);
  EXPECT_TRUE(clock.known());
  EXPECT_EQ(clock.to_local(0), 30);
}

TEST(ClockEstimate, is_bounded_in_memory_however_fast_the_peer_sends) {
  ClockEstimate clock(kWindow_ns);
  // Delay that only rises keeps every sample in a plain monotone queue.
  for (std::int64_t n = 0; n < 200'000; ++n) clock.observe(n * kMs / 10 - n, n * kMs / 10);
  // The window has room for 256 merged samples (kSamplesPerWindow) and a few at its ends.
  EXPECT_LE(clock.sample_count(), 260u);
}

// A peer may send any clock. Sums at the ends of 64 bits must saturate, and keep the order of times.
TEST(ClockEstimate, bears_any_clock) {
  constexpr std::int64_t kFar = std::numeric_limits<std::int64_t>::max();
  for (const std::int64_t peer_ns : {kFar, -kFar, std::int64_t{0}}) {
    for (const std::int64_t now_ns : {std::int64_t{0}, kFar}) {
      ClockEstimate clock(kWindow_ns);
      clock.observe(peer_ns, now_ns);
      // Numbers may be wrong at the ends, but an earlier time must not come after a later one.
      EXPECT_LE(clock.to_local(-kFar), clock.to_local(kFar)) << "order survives where numbers cannot";
    }
  }
}

}  // namespace
}  // namespace hairnet::channel
