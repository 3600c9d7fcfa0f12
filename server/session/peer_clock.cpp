#include "server/session/peer_clock.hpp"

#include <algorithm>
#include <cstdlib>
#include <limits>

#include "core/assert.hpp"

namespace hairnet::server {

// Sums of two times that the wire carries cannot overflow.
static_assert(PeerClock::kClockMax_ns < std::numeric_limits<std::int64_t>::max() / 2);
static_assert(PeerClock::kCaptureSpan_ns < PeerClock::kClockMax_ns);

bool PeerClock::observe(std::int64_t peer_clock_ns, std::int64_t now_ns) {
  // The clock comes from the client and may be anything; unchecked, the differences below could overflow.
  if (peer_clock_ns > kClockMax_ns || peer_clock_ns < -kClockMax_ns) return false;
  estimate_.observe(peer_clock_ns, now_ns);
  peer_ns_ = peer_clock_ns;
  const std::int64_t error_ns = estimate_.to_local(peer_clock_ns) - peer_clock_ns - offset_ns_;
  // Slew: between two envelopes the offset may move by kSlew of the time that passed. A jump of the offset would look
  // like a jump of the head, which the solver would answer with a swing of hair.
  if (!started_ || std::abs(error_ns) > kJump_ns) {
    offset_ns_ += error_ns;
  } else {
    const auto step_ns =
        static_cast<std::int64_t>(kSlew * static_cast<double>(std::max<std::int64_t>(0, now_ns - slewed_at_ns_)));
    offset_ns_ += std::clamp(error_ns, -step_ns, step_ns);
  }
  started_ = true;
  slewed_at_ns_ = now_ns;
  // Either the error was corrected, or it was at most kJump_ns and slewing has not increased it.
  HAIRNET_ASSERT(std::abs(estimate_.to_local(peer_clock_ns) - peer_clock_ns - offset_ns_) <= kJump_ns);
  return true;
}

std::optional<std::int64_t> PeerClock::to_server(std::int64_t peer_time_ns) const {
  if (!started_ || peer_time_ns > peer_ns_ + kCaptureSpan_ns || peer_time_ns < peer_ns_ - kCaptureSpan_ns) return {};
  // The newest envelope bounds the capture time on both sides, so a client cannot name a time at which the sum
  // overflows.
  return peer_time_ns + offset_ns_;
}

}  // namespace hairnet::server
