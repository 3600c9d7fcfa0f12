#include "client/viewer/sources/stream_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace hairnet::viewer {

void StreamStatistics::count_frames(const link::FrameBatch& batch, std::int64_t latency_ns) {
  // Only the last batches count, so that a stream of days needs no more memory.
  if (latencies_ns_.size() < kLatenciesMax)
    latencies_ns_.push_back(latency_ns);
  else
    latencies_ns_[latency_count_ % kLatenciesMax] = latency_ns;
  ++latency_count_;
  for (const link::Frame& frame : batch.frames) {
    ++frame_count_;
    const auto [last, is_first] = last_frame_.try_emplace(frame.member);
    // Ticks without a step of the character have no frame: the next is due a stride later.
    const std::uint64_t due = last->second.tick + frame.step_stride;
    // A sleeping character sends nothing until it wakes, so a gap after sleep misses nothing.
    if (!is_first && batch.tick > due && !last->second.asleep)
      missed_tick_count_ += (batch.tick - due) / frame.step_stride;
    last->second = {batch.tick, frame.asleep};
  }
}

void StreamStatistics::count_displacement(std::uint32_t character, const std::vector<Vec3f>& displacement) {
  // An empty lattice counts as the design.
  Displaced& displaced = last_displacement_[character] = {};
  if (displacement.empty()) return;
  double sum_squares = 0;
  for (const Vec3f& d : displacement) {
    sum_squares += double{d.squaredNorm()};
    displaced.max_mm = std::max(displaced.max_mm, 1e3 * double{d.norm()});
  }
  displaced.rms_mm = 1e3 * std::sqrt(sum_squares / static_cast<double>(displacement.size()));
}

double StreamStatistics::latency_ms(double quantile) const {
  if (latencies_ns_.empty()) return 0;
  std::vector<std::int64_t> sorted = latencies_ns_;
  std::sort(sorted.begin(), sorted.end());
  // The nearest lower rank, without interpolation.
  const auto at = static_cast<std::size_t>(quantile * static_cast<double>(sorted.size() - 1));
  return 1e-6 * static_cast<double>(sorted[at]);
}

std::string StreamStatistics::summary() const {
  char line[256];
  std::snprintf(
      line, sizeof line,
      "%llu poses sent, %llu frames received, %llu ticks missed, pose to frame %.1f ms (median), %.1f ms (95 %%), "
      "%.0f bytes a frame\n",
      static_cast<unsigned long long>(poses_sent_), static_cast<unsigned long long>(frame_count_),
      static_cast<unsigned long long>(missed_tick_count_), latency_ms(0.5), latency_ms(0.95),
      // Bytes of frames alone, without what else the connection carries.
      frame_count_ == 0 ? 0.0 : static_cast<double>(link_.frame_bytes_received) / static_cast<double>(frame_count_));
  std::string lines = line;
  for (const auto& [character, displaced] : last_displacement_) {
    std::snprintf(line, sizeof line, "character %u at the end: RMS %.3f mm, max %.3f mm from the design\n", character,
                  displaced.rms_mm, displaced.max_mm);
    lines += line;
  }
  if (link_.frames_dropped + link_.poses_dropped > 0) {
    std::snprintf(line, sizeof line, "dropped here: %llu frames, %llu poses\n",
                  static_cast<unsigned long long>(link_.frames_dropped),
                  static_cast<unsigned long long>(link_.poses_dropped));
    lines += line;
  }
  return lines;
}

}  // namespace hairnet::viewer
