#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "client/link/frame.hpp"
#include "core/levels/level.hpp"

namespace hairnet::link {

// The jitter buffer of one character: plays its frames smoothly, with a small delay behind the newest. It interpolates
// between two frames; when no frame comes it freezes for 100 ms, or for two steps of the
// character if that is longer, then eases to rest; a sleeping character stays frozen
// until it wakes. Time is a parameter, always on the client's clock. One thread.
//
// Between two frames, coefficients move along the parabola through the frame before as well, or in a straight line
// where there is none.
//
// The lateness of a frame is its arrival time minus its sample time. The play-out delay is the smallest lateness of the
// last frames, plus one frame interval (to have a frame to interpolate to), plus the larger of their jitter and half an
// interval. The interval is one that nine of ten do not exceed, so that frames that are lost now and then leave no gap.
class Playout {
 public:
  // Takes a frame whose poses were sampled at `sample_time_ns` and which arrived at `arrival_time_ns`. Drops duplicates
  // and frames that are not newer than the play time. Asserts that it has no more coefficients than its basis has
  // modes.
  void push(const Frame& frame, std::int64_t sample_time_ns, std::int64_t arrival_time_ns);

  // Freezes the shown state until the next frame arrives. For callers that know that no frame will come for a while, as
  // during a reconnect.
  void freeze();

  struct Sample {
    bool valid = false;  // false until the first frame
    Pose pose;
    LevelIndex level = LevelIndex::rigid;  // that the server steps
    // Of the basis's active nodes, head space, m; empty: at rest. Until the next call.
    std::span<const Vec3f> displacement;
    std::int64_t time_ns = 0;                       // the sample time that is shown; never goes back
    std::shared_ptr<const LevelGeometry> geometry;  // of the displacement; null: at rest
  };
  // Returns what to draw at `render_time_ns`. A time before the last one counts as the last one.
  Sample sample(std::int64_t render_time_ns);

  [[nodiscard]] std::uint64_t dropped_count() const { return dropped_count_; }
  [[nodiscard]] std::int64_t delay_ns() const { return delay_ns_; }  // from sample time to play time

 private:
  struct BufferedFrame {
    std::int64_t time_ns = 0;
    bool discontinuous = false;
    bool asleep = false;  // shown until a newer frame comes
    Pose pose;
    LevelIndex level = LevelIndex::rigid;
    std::vector<float> coefficients;
    std::int64_t step_ns = 0;                 // from one step of the character to the next; 0: not known
    std::shared_ptr<const KnownBasis> basis;  // null: at rest
  };
  struct Arrival {
    std::int64_t time_ns, lateness_ns;
  };
  void record_arrival(std::int64_t sample_time_ns, std::int64_t arrival_time_ns);
  [[nodiscard]] std::int64_t target_delay_ns() const;
  void advance(std::int64_t render_time_ns);
  static bool are_joined(const BufferedFrame& from, const BufferedFrame& to);
  void show_between(const BufferedFrame& from, const BufferedFrame& to);
  void show_last(const BufferedFrame& last);
  void check_invariants() const;

  std::deque<BufferedFrame> frames_;     // by time; at most one at or before the play time once sampled
  std::optional<BufferedFrame> before_;  // the frame before the first of these
  std::deque<Arrival> arrivals_;         // of the last frames, by arrival
  BufferedFrame shown_;                  // the last result of sample()
  std::vector<Vec3f> displacement_;      // of the same
  bool started_ = false;                 // sample() has returned a valid sample
  std::int64_t render_time_ns_ = 0;
  std::int64_t delay_ns_ = 0;
  std::uint64_t dropped_count_ = 0;
};

}  // namespace hairnet::link
