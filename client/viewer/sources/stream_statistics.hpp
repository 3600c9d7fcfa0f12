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
  // `latency_ns` is the time from the sampling of the batch's poses to the arrival of the batch, on this client's
  // clock. The server's clock was fitted by the packets with the smallest delay, so the smallest one-way delay of the
  // network is not in it.
  void count_frames(const link::FrameBatch& batch, std::int64_t latency_ns);
  void take_counters(const link::LinkCounters& counters) { link_ = counters; }
  // Call it when a member leaves: another one may get its number.
  void forget(std::uint32_t member) { last_frame_.erase(member); }
  // Measures the lattice that was received last for a character; displacements in head space.
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
  // Each member's last frame.
  std::map<std::uint32_t, LastFrame> last_frame_;
  // The last lattice of each own character, by its own number.
  std::map<std::uint32_t, Displaced> last_displacement_;
  // The most latencies that are stored.
  static constexpr std::size_t kLatenciesMax = 100'000;
  // The latencies; once full, new ones replace the oldest (a ring).
  std::vector<std::int64_t> latencies_ns_;
  std::size_t latency_count_ = 0;
  std::uint64_t frame_count_ = 0, missed_tick_count_ = 0, poses_sent_ = 0;
  link::LinkCounters link_;
};

}  // namespace hairnet::viewer
