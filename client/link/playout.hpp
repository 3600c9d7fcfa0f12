#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "client/link/frame.hpp"
#include "core/levels/level.hpp"
#include "core/modes/moved_lattice.hpp"

namespace hairnet::link {

// The jitter buffer of one character: plays its frames smoothly, with a small delay behind the newest. When no frame
// comes it goes on, slower and slower, freezes, and after 100 ms, or after two steps of the character if that is
// longer, eases to rest; a sleeping character stays frozen until it wakes. Time is a parameter, always on the client's
// clock. One thread.
//
// Between two frames, coefficients move along a cubic whose slope at a frame is that of the parabola through it and its
// neighbours. A frame that comes after its turn changes this curve: what is shown then is eased onto the new one.
//
// The lateness of a frame is its arrival time minus its sample time. The play-out delay is the smallest lateness of the
// last frames, plus one frame interval (to have a frame to interpolate to), plus the larger of their jitter and half an
// interval. The interval is one that nine of ten do not exceed, so that frames that are lost now and then leave no gap.
class Playout {
 public:
  // Takes a frame whose poses were sampled at `sample_time_ns` and which arrived at `arrival_time_ns`. Drops duplicates
  // and frames that are older than the one that is played; a frame that had no basis yet may come again with it.
  // Asserts that it has no more coefficients than its basis has modes.
  void push(const Frame& frame, std::int64_t sample_time_ns, std::int64_t arrival_time_ns);

  // Freezes the shown state until the next frame arrives. For callers that know that no frame will come for a while, as
  // during a reconnect.
  void freeze();

  struct Sample {
    // Is false until the first frame.
    bool valid = false;
    Pose pose;
    // Is the level that the server steps.
    LevelIndex level = LevelIndex::rigid;
    // Holds coefficients of the basis, m; those that are missing are 0. They are valid until the next call.
    std::span<const float> coefficients;
    // Is null at rest.
    std::shared_ptr<const KnownBasis> basis;
    // Is the sample time that is shown; it never goes back.
    std::int64_t time_ns = 0;
    [[nodiscard]] std::shared_ptr<const LevelGeometry> geometry() const {
      return basis ? std::shared_ptr<const LevelGeometry>(basis, &basis->hair.geometry) : nullptr;
    }
    // What moves the hair; valid until the next call.
    [[nodiscard]] MovedLattice lattice() const {
      if (!basis) return {};
      return {&basis->hair.geometry, {}, {basis, &basis->hair.basis}, coefficients};
    }
  };
  // Returns what to draw at `render_time_ns`. A time before the last one counts as the last one.
  Sample sample(std::int64_t render_time_ns);

  [[nodiscard]] std::uint64_t dropped_count() const { return dropped_count_; }
  // Returns the time that passes from sample time to play time.
  [[nodiscard]] std::int64_t delay_ns() const { return delay_ns_; }

 private:
  struct State {
    Pose pose;
    LevelIndex level = LevelIndex::rigid;
    std::vector<float> coefficients;
    // Is null at rest.
    std::shared_ptr<const KnownBasis> basis;
  };
  struct BufferedFrame {
    std::int64_t time_ns = 0;
    bool discontinuous = false;
    // The frame is shown until a newer one comes.
    bool asleep = false;
    // Is the time from one step of the character to the next; zero means not known.
    std::int64_t step_ns = 0;
    State state;
  };
  struct Arrival {
    std::int64_t time_ns, lateness_ns;
  };
  // Describes what a frame that came after its turn has changed: the state that was shown then, and the state of the
  // new curve at that time.
  struct Correction {
    State shown, curve;
    std::int64_t begun_ns = 0, duration_ns = 0;
  };
  // Holds the shares of frames i - 2 to i + 2 in the coefficients that are shown, where i is the played frame.
  using Weights = std::array<double, 5>;

  void record_arrival(std::int64_t sample_time_ns, std::int64_t arrival_time_ns);
  [[nodiscard]] std::int64_t target_delay_ns() const;
  void advance(std::int64_t render_time_ns);
  [[nodiscard]] std::size_t index_at(std::int64_t time_ns) const;
  [[nodiscard]] static bool are_joined(const State& from, const State& to);
  [[nodiscard]] bool is_joined(std::size_t i) const;
  [[nodiscard]] bool is_smooth(std::size_t i) const;
  [[nodiscard]] double duration_ns(std::size_t i) const;
  void add_difference(std::size_t i, std::size_t j, double share, Weights& weights) const;
  void add_slope(std::size_t i, std::size_t j, double share, Weights& weights) const;
  void blend(std::size_t i, const Weights& weights, State& out) const;
  void curve_at(std::int64_t time_ns, State& out) const;
  void between(std::size_t i, std::int64_t time_ns, State& out) const;
  void after_last(std::int64_t time_ns, State& out) const;
  void correct(std::int64_t gap_ns);
  void apply_correction();
  void check_invariants() const;

  // Sorted by time; once sampled, at most three lie at or before the play time.
  std::deque<BufferedFrame> frames_;
  // Holds the last frames, in the order of their arrival.
  std::deque<Arrival> arrivals_;
  // Are the smallest and the largest lateness in arrivals_.
  std::int64_t min_late_ns_ = 0, max_late_ns_ = 0;
  // Nine tenths of the intervals between frames are not longer.
  std::int64_t interval_ns_ = 0;
  // Are the state and the sample time that sample() returned last.
  State shown_;
  std::int64_t time_ns_ = 0;
  std::optional<Correction> correction_;
  // sample() has returned a valid sample.
  bool started_ = false;
  // Is the latest time that the caller has passed to sample().
  std::int64_t render_time_ns_ = 0;
  // Follows target_delay_ns() slowly.
  std::int64_t delay_ns_ = 0;
  std::uint64_t dropped_count_ = 0;
};

}  // namespace hairnet::link
