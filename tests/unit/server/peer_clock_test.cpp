#include "server/session/peer_clock.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "server/threading/token_bucket.hpp"

namespace hairnet::server {
namespace {

constexpr std::int64_t kMs = 1'000'000;

TEST(PeerClock, knows_no_time_before_the_first_envelope) {
  EXPECT_FALSE(PeerClock().to_server(0));
}

TEST(PeerClock, follows_the_least_delayed_envelope) {
  PeerClock clock;
  std::int64_t now_ns = 1'000'000 * kMs;
  // The client's clock is 77 s behind, and its packets travel for 0 to 9 ms. The fastest of them show the offset best;
  // 0.1 ms of error is allowed.
  for (int i = 0; i < 500; ++i, now_ns += 10 * kMs) clock.observe(now_ns - 77'000 * kMs - (i % 10) * kMs, now_ns);
  EXPECT_NEAR(static_cast<double>(*clock.to_server(now_ns - 77'000 * kMs) - now_ns), 0, 1e5);
}

TEST(PeerClock, a_better_estimate_moves_mapped_times_slowly) {
  PeerClock clock;
  // The first packet travels for 20 ms, and all later ones for none, so the estimate jumps by 20 ms. Times in use may
  // only slide by 1 % (kSlew), 0.1 ms in 10 ms, or heads would jump; after 2 s they are exact.
  clock.observe(980 * kMs, 1000 * kMs);
  std::int64_t before_ns = *clock.to_server(980 * kMs);
  for (int i = 1; i < 300; ++i) {
    const std::int64_t now_ns = (1000 + 10 * i) * kMs;
    clock.observe(now_ns, now_ns);
    const std::int64_t mapped_ns = *clock.to_server(980 * kMs + 10 * i * kMs);
    EXPECT_NEAR(static_cast<double>(mapped_ns - before_ns), 10.0 * kMs, 0.11 * kMs);
    before_ns = mapped_ns;
  }
  EXPECT_EQ(*clock.to_server(4000 * kMs), 4000 * kMs);
}

TEST(PeerClock, refuses_clocks_that_would_overflow_and_captures_far_from_their_envelope) {
  PeerClock clock;
  EXPECT_FALSE(clock.observe(std::numeric_limits<std::int64_t>::max(), 0));
  EXPECT_FALSE(clock.observe(std::numeric_limits<std::int64_t>::min(), 0));
  EXPECT_TRUE(clock.observe(0, 0));
  EXPECT_FALSE(clock.to_server(std::numeric_limits<std::int64_t>::max()));
  EXPECT_FALSE(clock.to_server(std::numeric_limits<std::int64_t>::min()));
}

TEST(TokenBucket, allows_a_burst_and_then_the_rate) {
  TokenBucket bucket(10, 5, 0);
  int taken = 0;
  while (bucket.take(1, 0)) ++taken;
  EXPECT_EQ(taken, 5);
  for (std::int64_t now_ns = 0; now_ns < 10'000 * kMs; now_ns += kMs) taken += bucket.take(1, now_ns);
  // The burst is 5, and 10 s at 10 a second give 100 more.
  EXPECT_NEAR(taken, 105, 1);
}

TEST(TokenBucket, leaves_a_reserve_to_those_who_need_none) {
  TokenBucket bucket(1, 10, 0);
  // The third argument is what must be left in the bucket of 10.
  EXPECT_TRUE(bucket.take(6, 0, 4));
  EXPECT_FALSE(bucket.take(1, 0, 4));
  EXPECT_TRUE(bucket.take(4, 0));
}

}  // namespace
}  // namespace hairnet::server
