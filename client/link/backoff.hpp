#pragma once

#include <cstdint>

namespace hairnet::link {

// How long to wait before the next attempt to connect: at random between nothing and as long as the connection has been
// away (full jitter). So clients of a server that restarts do not come back as one, they ask ever less often, and each is
// back after at most twice the time that the server was away, and kBoundLeast_ns. Seeded; one thread.
class Backoff {
 public:
  static constexpr std::int64_t kBoundLeast_ns = 100'000'000;
  static constexpr std::int64_t kBoundMost_ns = 5'000'000'000;

  explicit Backoff(std::uint64_t seed) : state_(seed) {}
  std::int64_t next_ns(std::int64_t away_ns);

 private:
  std::uint64_t state_;
};

}  // namespace hairnet::link
