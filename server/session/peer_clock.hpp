#pragma once

#include <cstdint>
#include <optional>

#include "schema/channel/clock_estimate.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::server {

// Converts a client's clock to the server's clock. The offset estimate jumps when better samples come and old ones are
// dropped. Pose times must not jump, so the offset in use moves slowly towards the estimate.
class PeerClock {
 public:
  // Clocks whose absolute value exceeds this are refused, so that sums cannot overflow.
  static constexpr std::int64_t kClockMax_ns = wire::kTimeMax_ns;
  // A capture time may differ from the clock of its envelope by at most this much.
  static constexpr std::int64_t kCaptureSpan_ns = 60'000'000'000;
  // A larger error is corrected at once: slewing it would take seconds (5 s for 50 ms), during which poses come too
  // early or late.
  static constexpr std::int64_t kJump_ns = 50'000'000;
  // The offset moves by at most this share of elapsed time, so a head's speed changes by at most 1 % meanwhile.
  static constexpr double kSlew = 0.01;

  // False when the clock exceeds kClockMax_ns; the sample is then not used.
  bool observe(std::int64_t peer_clock_ns, std::int64_t now_ns);
  // Converts a capture time to the server's clock. None before the first sample, and for a time that differs by more
  // than kCaptureSpan_ns from the clock of the newest envelope.
  [[nodiscard]] std::optional<std::int64_t> to_server(std::int64_t peer_time_ns) const;

 private:
  channel::ClockEstimate estimate_;
  // The client's clock in the newest envelope.
  std::int64_t peer_ns_ = 0;
  // The offset in use: server time minus peer time.
  std::int64_t offset_ns_ = 0;
  // The offset was last moved towards the estimate at this time.
  std::int64_t slewed_at_ns_ = 0;
  // A sample has been observed, so there is an offset.
  bool started_ = false;
};

}  // namespace hairnet::server
