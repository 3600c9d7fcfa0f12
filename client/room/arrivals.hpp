#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

namespace hairnet::room {

// Estimates when frames really arrived. A thread that reads and draws may block for a while (shader linking, uploads to
// the GPU); frames that arrive meanwhile are all read afterwards, but were not late. Times in ns, of one clock.
class Arrivals {
 public:
  // The thread runs now. Call it after all that has arrived was read, with the time before reading.
  void on_awake(std::int64_t now_ns) { awake_ns_ = now_ns; }

  // The estimated arrival of a batch of frames that was read at `read_ns`; `sample_ns` is on this clock.
  std::int64_t time_of(std::int64_t sample_ns, std::int64_t read_ns) {
    if (read_ns - awake_ns_ <= kStalled_ns) {
      awake_ns_ = std::max(awake_ns_, read_ns);
      lateness_min_ns_ = std::min(lateness_min_ns_ + kForget_ns, read_ns - sample_ns);
      return read_ns;
    }
    if (lateness_min_ns_ == kUnknown_ns) return read_ns;
    // The batch counts as on time, that is, as late as the best ones, unless the thread would then have read it before
    // it blocked.
    return std::clamp(sample_ns + lateness_min_ns_, awake_ns_, read_ns);
  }

 private:
  // A thread that has not run for longer than this counts as blocked: some four pictures at 60 Hz.
  static constexpr std::int64_t kStalled_ns = 60'000'000;
  // The remembered minimum of the lateness grows by this with each batch, so it follows clocks that drift apart.
  static constexpr std::int64_t kForget_ns = 100'000;
  static constexpr std::int64_t kUnknown_ns = std::numeric_limits<std::int64_t>::max() - kForget_ns;
  // The last time at which the thread is known to have run.
  std::int64_t awake_ns_ = std::numeric_limits<std::int64_t>::min() / 2;
  // The smallest time from a batch's sampling to its reading, raised by kForget_ns with each batch.
  std::int64_t lateness_min_ns_ = kUnknown_ns;
};

}  // namespace hairnet::room
