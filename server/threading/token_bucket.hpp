#pragma once

#include <algorithm>
#include <cstdint>

#include "core/assert.hpp"

namespace hairnet::server {

// A token bucket: allows `burst` at once and `rate_per_s` on average. It reads no clock, and belongs to one thread. It
// begins full, so a new peer may use its burst at once.
class TokenBucket {
 public:
  TokenBucket(double rate_per_s, double burst, std::int64_t now_ns)
      : rate_per_s_(rate_per_s), burst_(burst), tokens_(burst), at_ns_(now_ns) {
    HAIRNET_ASSERT(rate_per_s >= 0);
    HAIRNET_ASSERT(burst >= 0);
  }

  // Takes nothing and returns false when fewer than `count + reserve` tokens are left. A time before the last one
  // counts as the last one. `reserve` leaves tokens for others: something less important may only take what is beyond
  // them. A `count` above `burst` is never given.
  bool take(double count, std::int64_t now_ns, double reserve = 0) {
    HAIRNET_ASSERT(count >= 0);
    HAIRNET_ASSERT(reserve >= 0);
    tokens_ = std::min(burst_,
                       tokens_ + rate_per_s_ * 1e-9 * static_cast<double>(std::max<std::int64_t>(0, now_ns - at_ns_)));
    at_ns_ = std::max(at_ns_, now_ns);
    if (tokens_ < count + reserve) return false;
    tokens_ -= count;
    return true;
  }

 private:
  double rate_per_s_, burst_, tokens_;
  std::int64_t at_ns_;
};

}  // namespace hairnet::server
