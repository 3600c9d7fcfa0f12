#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/levels/level.hpp"
#include "tests/load/latency_histogram.hpp"
#include "tests/load/plan.hpp"

namespace hairnet::load {

inline constexpr std::array<std::uint32_t, 3> kStrides{1, 2, 4};

// Counts over a time, of the well-behaved clients except for `bad_client_ends`.
struct Counts {
  // Counts one a character.
  std::uint64_t poses_intended = 0;
  std::uint64_t poses_sent = 0;
  // Counts poses for which there was no session, or the server took no more bytes.
  std::uint64_t poses_unsent = 0;
  // Counts poses answered by a frame sampled at or after them.
  std::uint64_t poses_answered = 0;
  std::uint64_t poses_unanswered = 0;
  // Counts poses of characters at rest, which owe no frame.
  std::uint64_t poses_asleep = 0;
  // Counts those of own characters.
  std::uint64_t frames = 0;
  // Counts by tick and stride.
  std::uint64_t frames_missed = 0;
  // Is the longest way between two own frames: 1 when none is missed, at any stride.
  std::uint64_t gap_ticks_max = 0;
  std::uint64_t frames_of_others = 0;
  // Counts frames whose bytes were wrong.
  std::uint64_t frames_undecodable = 0;
  // Count lost connections after which the server had the session, or had not.
  std::uint64_t resumes = 0, restarts = 0;
  std::uint64_t frames_discontinuous = 0;
  // Counts own frames and others'.
  std::array<std::uint64_t, kLevelCount> frames_by_level{};
  std::array<std::uint64_t, kStrides.size()> frames_by_stride{};
  // Count bytes of packets.
  std::uint64_t bytes_in = 0, bytes_out = 0;
  // Counts bytes of nodes alone, in frames.
  std::uint64_t content_bytes = 0;
  // Count characters: those whose first frame came, and those whose first frame never came.
  std::uint64_t joins = 0, joins_unanswered = 0;
  // Counts samples of all hands of a client.
  std::uint64_t hands_sent = 0;
  // Count holds that hold hair, those of none or that ended by themselves, and the points of the former.
  std::uint64_t holds = 0, holds_empty = 0, held_points = 0;
  // Are the sums of their times.
  double client_s = 0, character_s = 0;
  // Counts by reason.
  std::map<std::string, std::uint64_t, std::less<>> errors;
  // The key is "kind: reason".
  std::map<std::string, std::uint64_t, std::less<>> bad_client_ends;

  void add_error(std::string_view reason);
};

struct StageTally {
  Counts counts;
  // Lasts between a pose's intended capture and the arrival of the first frame sampled at or after it.
  LatencyHistogram latency;
  // Lasts between sampling and arrival of the first frame of a tick at a client.
  LatencyHistogram frame_age;
  // Lasts likewise for every frame of others.
  LatencyHistogram others_age;
  // Lasts between one frame of another and its next.
  LatencyHistogram others_interval;
  // Is |arrivals apart - ticks apart|.
  LatencyHistogram jitter;
  // Lasts between intended arrival and first frame.
  LatencyHistogram join;
  // Lasts between a hand's intended capture and the arrival, at another client, of hands sampled at or after it; those
  // clients get frames of hair that is moved by them at the same time.
  LatencyHistogram hands_latency;
  // Says how late the generator itself does what is intended.
  LatencyHistogram lag;
};

// A second or so of a run, for plots.
struct WindowFigures {
  double begin_s = 0, duration_s = 0;
  // Belong to poses captured in the window.
  double latency_p50_ms = 0, latency_p99_ms = 0, latency_max_ms = 0;
  double lag_max_ms = 0;
  double clients = 0, characters = 0;
  std::uint64_t frames = 0, frames_missed = 0, bytes_in = 0, bytes_out = 0, content_bytes = 0, errors = 0;
  std::uint64_t poses_unanswered = 0, poses_unsent = 0;
  std::array<std::uint64_t, kLevelCount> frames_by_level{};
};

// All that is counted of a run, by stage and by window. What happens is counted where it happened, but what became of a
// pose where the pose was captured, however late. One thread; times are of the clock that `begin_ns` is of.
class Tally {
 public:
  Tally(const Plan& plan, std::int64_t begin_ns, std::int64_t window_ns = 1'000'000'000);

  void count(std::int64_t now_ns, std::uint64_t Counts::*which, std::uint64_t by = 1);
  void count_error(std::int64_t now_ns, std::string_view reason);
  void count_bad_client_end(std::int64_t now_ns, std::string_view kind, std::string_view reason);
  void record_answer(std::int64_t captured_ns, std::int64_t arrived_ns, std::uint64_t characters);
  // Waited in vain until `now_ns`.
  void record_unanswered(std::int64_t captured_ns, std::int64_t now_ns, std::uint64_t characters);
  void record_join(std::int64_t intended_ns, std::int64_t now_ns, bool answered);
  void record_lag(std::int64_t intended_ns, std::int64_t now_ns);
  void record_frame(std::int64_t now_ns, LevelIndex level, std::uint32_t stride, std::size_t content_bytes,
                    bool discontinuous, bool own);
  // An own frame that came `ticks` after the one before it, which announced it for `stride` ticks later.
  void record_gap(std::int64_t now_ns, std::uint64_t ticks, std::uint32_t stride);
  void record_frame_age(std::int64_t sampled_ns, std::int64_t arrived_ns);
  // `before_ns`: when the one before it arrived; 0: there was none, or it was asleep.
  void record_frame_of_other(std::int64_t sampled_ns, std::int64_t arrived_ns, std::int64_t before_ns);
  void record_hands(std::int64_t captured_ns, std::int64_t arrived_ns);
  void record_jitter(std::int64_t now_ns, std::int64_t deviation_ns);
  // How many were there since the last call.
  void note_population(std::int64_t now_ns, std::size_t clients, std::size_t characters);
  // Closes windows that are over; `finish` all of them.
  void advance(std::int64_t now_ns);
  void finish(std::int64_t now_ns);

  // Leaves out the stage's warm-up.
  [[nodiscard]] const StageTally& stage(std::size_t index) const { return stages_[2 * index + 1]; }
  [[nodiscard]] const std::vector<WindowFigures>& windows() const { return windows_; }
  // The last window that is over, its last answers still under way; all zero at first.
  [[nodiscard]] WindowFigures latest(std::int64_t now_ns) const;
  // Covers the whole run.
  [[nodiscard]] const LatencyHistogram& lag() const { return lag_; }

 private:
  struct Window {
    Counts counts;
    LatencyHistogram latency, lag;
  };
  StageTally& at(std::int64_t time_ns);
  Window& window_at(std::int64_t time_ns);
  void close_window(double duration_s);
  [[nodiscard]] WindowFigures figures_of(const Window& window, std::size_t index, double duration_s) const;

  std::int64_t begin_ns_, window_ns_;
  // Holds the ends of the parts: each stage's warm-up and rest, in turn.
  std::vector<std::int64_t> ends_ns_;
  // Is like `ends_ns_`, and has one more for events after the end.
  std::vector<StageTally> stages_;
  // Is the part of the latest time seen.
  std::size_t newest_ = 0;
  LatencyHistogram lag_;
  std::int64_t window_count_max_ = 0;
  // The first is number windows_.size().
  std::deque<Window> open_;
  // Holds what comes after the end.
  Window after_;
  std::vector<WindowFigures> windows_;
  std::int64_t population_ns_;
};

}  // namespace hairnet::load
