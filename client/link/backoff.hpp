#pragma once

#include <cstdint>

namespace hairnet::link {

// Computes the wait before the next connection attempt. It is random, from 0 up to the length of the outage so far
// ("full jitter"), clamped to kBoundMin_ns ... kBoundMax_ns. Chance keeps the clients of a restarted server from
// reconnecting all at once. A client is back after at most twice the outage plus kBoundMin_ns. The same seed gives the
// same waits. One thread.
class Backoff {
 public:
  // The bound of the first waits, 0.1 s, and the longest bound, 5 s.
  static constexpr std::int64_t kBoundMin_ns = 100'000'000;
  static constexpr std::int64_t kBoundMax_ns = 5'000'000'000;

  explicit Backoff(std::uint64_t seed) : state_(seed) {}
  // Returns the next wait. `away_ns`: how long the outage has lasted.
  std::int64_t next_ns(std::int64_t away_ns);

 private:
  std::uint64_t state_;
};

}  // namespace hairnet::link
