#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>

namespace hairnet::channel {

// Estimates the offset from the peer's monotonic clock to ours from the clock in its envelopes. It takes the minimum
// over a sliding window, so that it follows drift. The estimate includes the smallest one-way delay. Any clock values
// are safe: sums saturate.
class ClockEstimate {
 public:
  explicit ClockEstimate(std::int64_t window_ns = 10'000'000'000);
  // `now_ns` must not decrease from call to call.
  void observe(std::int64_t peer_clock_ns, std::int64_t now_ns);
  [[nodiscard]] bool known() const { return !window_.empty(); }
  // Converts a time of the peer's clock to ours. Asserts known().
  [[nodiscard]] std::int64_t to_local(std::int64_t peer_time_ns) const;
  [[nodiscard]] std::size_t sample_count() const { return window_.size(); }  // bounded, for any rate

 private:
  // When a message came, and our clock less the peer's clock in it.
  struct Sample {
    std::int64_t at_ns, offset_ns;
  };
  // The length of the window.
  std::int64_t window_ns_;
  // The samples that may still become the minimum. Times and offsets ascend, so the first one is the minimum now.
  std::deque<Sample> window_;
};

}  // namespace hairnet::channel
