#pragma once

#include <cstdint>

namespace hairnet::link {

// How long to wait before the next attempt to connect: at random between nothing and a bound that doubles from attempt
// to attempt (full jitter), so that the clients of a server that restarts do not come back as one. Seeded; one thread.
class Backoff {
 public:
  static constexpr std::int64_t kBoundLeast_ns = 100'000'000;
  static constexpr std::int64_t kBoundMost_ns = 5'000'000'000;

  explicit Backoff(std::uint64_t seed) : state_(seed) {}
  std::int64_t next_ns();
  void reset() { bound_ns_ = kBoundLeast_ns; }  // all is well

 private:
  std::uint64_t state_;
  std::int64_t bound_ns_ = kBoundLeast_ns;
};

}  // namespace hairnet::link
