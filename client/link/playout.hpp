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

// The jitter buffer of one character: it plays the character's frames smoothly, with a small delay behind the newest
// one. When no frame comes, the hair goes on ever more slowly and stops. After 100 ms, or two steps of the character if
// that is longer, it eases to rest. A sleeping character stays as it is until it wakes. Time is a parameter, always on
// the client's clock. One thread.
// Between two frames, coefficients follow a cubic (Hermite) whose slope at a frame is that of the parabola through the
// frame and its neighbours. A frame that comes late changes this curve; the difference to what was shown is then faded
// out.
// The lateness of a frame is its arrival time minus its sample time. The delay of the play-out is the smallest lateness
// of the last frames, plus one frame interval (to have a frame to interpolate to), plus the larger of their jitter and
// half an interval. The interval is one that nine of ten do not exceed, so that frames that are lost now and then leave
// no gap.
class Playout {
 public:
  // Takes a frame whose poses were sampled at `sample_time_ns` and which arrived at `arrival_time_ns`. Drops
  // duplicates, and frames older than the one that is played. A frame with Frame::repeated replaces the coefficients of
  // the frame of the same time. Asserts that the frame has no more coefficients than its basis has modes.
  void push(const Frame& frame, std::int64_t sample_time_ns, std::int64_t arrival_time_ns);

  // Freezes the shown state until the next frame arrives. Callers that know that no frame will come for a while use it,
  // as during a reconnect.
  void freeze();

  struct Sample {
    // False until the first frame.
    bool valid = false;
    Pose pose;
    // The level that the server steps.
    LevelIndex level = LevelIndex::rigid;
    // Coefficients of the basis, m; those that are missing at the end are 0. Valid until the next call.
    std::span<const float> coefficients;
    // Null when the hair is at rest.
    std::shared_ptr<const KnownBasis> basis;
    // The sample time that is shown; it never goes back.
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

  // The number of frames that were dropped.
  [[nodiscard]] std::uint64_t dropped_count() const { return dropped_count_; }
  // Returns the time that passes from sample time to play time.
  [[nodiscard]] std::int64_t delay_ns() const { return delay_ns_; }

 private:
  // What is shown at one time.
  struct State {
    Pose pose;
    LevelIndex level = LevelIndex::rigid;
    std::vector<float> coefficients;
    // Null at rest.
    std::shared_ptr<const KnownBasis> basis;
  };
  // A frame that waits to be played, or is needed for the slope of the curve.
  struct BufferedFrame {
    std::int64_t time_ns = 0;
    bool discontinuous = false;
    // The frame is shown until a newer one comes.
    bool asleep = false;
    // The time from one step of the character to the next; zero means not known.
    std::int64_t step_ns = 0;
    State state;
  };
  struct Arrival {
    std::int64_t time_ns, lateness_ns;
  };
  // A frame that came late has changed the curve. `shown` is what was shown at that time, and `curve` the state of the
  // new curve at the same time. Their difference is faded out over `duration_ns`.
  struct Correction {
    State shown, curve;
    std::int64_t begun_ns = 0, duration_ns = 0;
  };
  // The weights of frames i - 2 to i + 2 in the shown coefficients, where frame i is the played one. They may be
  // negative.
  using Weights = std::array<double, 5>;

  void record_arrival(std::int64_t sample_time_ns, std::int64_t arrival_time_ns);
  // The delay that delay_ns_ approaches; the class's comment has its terms.
  [[nodiscard]] std::int64_t target_delay_ns() const;
  // Moves time_ns_ on, and delay_ns_ towards its target.
  void advance(std::int64_t render_time_ns);
  // The last frame that is not after this time, or the first one.
  [[nodiscard]] std::size_t index_at(std::int64_t time_ns) const;
  // Whether two states may be mixed: their coefficients belong to one basis, or one of them is at rest.
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

  // Sorted by time. Once sample() was called, at most three lie at or before the play time.
  std::deque<BufferedFrame> frames_;
  // The last frames, in the order of their arrival.
  std::deque<Arrival> arrivals_;
  // The smallest and the largest lateness in arrivals_.
  std::int64_t min_late_ns_ = 0, max_late_ns_ = 0;
  // Nine of ten intervals between the last frames are not longer than this one.
  std::int64_t interval_ns_ = 0;
  // The state and the sample time that sample() returned last.
  State shown_;
  std::int64_t time_ns_ = 0;
  // The correction that is being faded out.
  std::optional<Correction> correction_;
  // sample() has returned a valid sample.
  bool started_ = false;
  // The latest time that the caller has passed to sample().
  std::int64_t render_time_ns_ = 0;
  // Follows target_delay_ns() slowly.
  std::int64_t delay_ns_ = 0;
  std::uint64_t dropped_count_ = 0;
};

}  // namespace hairnet::link
