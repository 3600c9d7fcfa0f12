#pragma once

#include <array>
#include <cstddef>

namespace hairnet::viewer {

// The last kCount values of a measurement, for a graph: a ring, which ImGui can draw from any place. One thread.
class TimeGraph {
 public:
  // The values that the graph shows: four seconds of pictures at 60 Hz.
  static constexpr std::size_t kCount = 240;
  void add(float value) {
    values_[next_] = value;
    next_ = (next_ + 1) % kCount;
  }
  [[nodiscard]] const float* values() const { return values_.data(); }
  // Returns the index of the oldest value in values().
  [[nodiscard]] int oldest() const { return static_cast<int>(next_); }
  [[nodiscard]] float newest() const { return values_[(next_ + kCount - 1) % kCount]; }
  // Returns the largest value, at least 0.
  [[nodiscard]] float most() const {
    float most = 0;
    for (const float value : values_) most = value > most ? value : most;
    return most;
  }

 private:
  std::array<float, kCount> values_{};
  std::size_t next_ = 0;
};

struct Timings {
  // These time a picture, drawing it, a tick (ms), and one character's step (microseconds).
  TimeGraph frame_ms, draw_ms, tick_ms, step_us;
  // Only a server gives these: from pose to frame, ms, and all bytes of the connection.
  TimeGraph latency_ms, received_kb_per_s;
};

}  // namespace hairnet::viewer
