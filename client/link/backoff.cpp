#include "client/link/backoff.hpp"

#include <algorithm>

#include "core/assert.hpp"

namespace hairnet::link {

static_assert(0 < Backoff::kBoundMin_ns && Backoff::kBoundMin_ns <= Backoff::kBoundMax_ns);

namespace {

// SplitMix64 (Steele, Lea, Flood 2014): eight bytes of state, because a load test has thousands of these.
std::uint64_t next_random(std::uint64_t& state) {
  std::uint64_t z = state += 0x9e3779b97f4a7c15;
  z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9;
  z = (z ^ z >> 27) * 0x94d049bb133111eb;
  return z ^ z >> 31;
}

}  // namespace

std::int64_t Backoff::next_ns(std::int64_t away_ns) {
  const std::int64_t bound_ns = std::clamp(away_ns, kBoundMin_ns, kBoundMax_ns);
  // The remainder favours small waits by less than one in 10^9, since the bound is far below 2^64.
  const auto wait_ns = static_cast<std::int64_t>(next_random(state_) % static_cast<std::uint64_t>(bound_ns + 1));
  HAIRNET_ASSERT(wait_ns >= 0 && wait_ns <= kBoundMax_ns);
  return wait_ns;
}

}  // namespace hairnet::link
