#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "client/link/link.hpp"

namespace hairnet::viewer {

// Measures a stream: delays, frames and levels. What it counts is what this client received; lost frames show as missed
// ticks. One thread.
class StreamStatistics {
 public:
  void count_poses(std::size_t count) { poses_sent_ += count; }
  // `latency_ns` is the time from the sampling of the poses in the batch to the batch's arrival, on this client's
  // clock. The clock of the server was fitted with the least delay, so the network's least one-way delay is not in it.
  void count_frames(const link::FrameBatch& batch, std::int64_t latency_ns);
  void take_counters(const link::LinkCounters& counters) { link_ = counters; }
  // Call it when a member leaves: another one may get its number.
  void forget(std::uint32_t member) { last_frame_.erase(member); }
  // The size of the last lattice received, by character, head space.
  void count_displacement(std::uint32_t character, const std::vector<Vec3f>& displacement);

  [[nodiscard]] std::uint64_t frame_count() const { return frame_count_; }
  [[nodiscard]] std::uint64_t missed_tick_count() const { return missed_tick_count_; }
  // Covers the last kLatenciesMax batches. `quantile` is in 0 ... 1; 0 without batches.
  [[nodiscard]] double latency_ms(double quantile) const;
  // Returns several lines for people.
  [[nodiscard]] std::string summary() const;

 private:
  struct Displaced {
    double rms_mm = 0, max_mm = 0;
  };
  struct LastFrame {
    std::uint64_t tick = 0;
    // No frame is due before the character wakes.
    bool asleep = false;
  };
  // Holds each member's last frame.
  std::map<std::uint32_t, LastFrame> last_frame_;
  // Holds the last lattice of each own character, by its own number.
  std::map<std::uint32_t, Displaced> last_displacement_;
  static constexpr std::size_t kLatenciesMax = 100'000;
  // Is a ring once it is full.
  std::vector<std::int64_t> latencies_ns_;
  std::size_t latency_count_ = 0;
  std::uint64_t frame_count_ = 0, missed_tick_count_ = 0, poses_sent_ = 0;
  link::LinkCounters link_;
};

}  // namespace hairnet::viewer
