#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

namespace hairnet::room {

// Estimates when frames really arrived. A thread that reads and draws may block for a while (shader linking, uploads to
// the GPU); frames that arrive meanwhile are all read afterwards, but were not late. Times in ns, of one clock.
class Arrivals {
 public:
  // The thread runs at this moment. Call it after what has arrived was read, with the time before reading.
  void on_awake(std::int64_t now_ns) { awake_ns_ = now_ns; }

  // The estimated arrival of a batch of frames that was read at `read_ns`; `sample_ns` is on this clock.
  std::int64_t time_of(std::int64_t sample_ns, std::int64_t read_ns) {
    if (read_ns - awake_ns_ <= kStalled_ns) {
      awake_ns_ = std::max(awake_ns_, read_ns);
      lateness_min_ns_ = std::min(lateness_min_ns_ + kForget_ns, read_ns - sample_ns);
      return read_ns;
    }
    if (lateness_min_ns_ == kUnknown_ns) return read_ns;
    // On time, unless the thread would have read it before it blocked.
    return std::clamp(sample_ns + lateness_min_ns_, awake_ns_, read_ns);
  }

 private:
  static constexpr std::int64_t kStalled_ns = 60'000'000;
  // The remembered minimum of the lateness grows by this with each batch, so it follows clocks that drift apart.
  static constexpr std::int64_t kForget_ns = 100'000;
  static constexpr std::int64_t kUnknown_ns = std::numeric_limits<std::int64_t>::max() - kForget_ns;
  std::int64_t awake_ns_ = std::numeric_limits<std::int64_t>::min() / 2;
  std::int64_t lateness_min_ns_ = kUnknown_ns;
};

}  // namespace hairnet::room
