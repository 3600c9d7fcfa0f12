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

// The strides that a server uses: a character is stepped at each, each second or each fourth tick.
inline constexpr std::array<std::uint32_t, 3> kStrides{1, 2, 4};

// What happened during a stage or a window. All counts except `bad_client_ends` leave misbehaving clients out.
struct Counts {
  // The poses that were due. The pose counts are of single characters: a client with five characters counts five.
  std::uint64_t poses_intended = 0;
  std::uint64_t poses_sent = 0;
  // The poses that were due when there was no session, or when too many unsent bytes waited (kUnsentBytesMax).
  std::uint64_t poses_unsent = 0;
  // The poses that a frame has answered: one sampled at their capture or later.
  std::uint64_t poses_answered = 0;
  std::uint64_t poses_unanswered = 0;
  // The poses of characters at rest, for which a server sends no frames.
  std::uint64_t poses_asleep = 0;
  // The frames of a client's own characters.
  std::uint64_t frames = 0;
  // The frames that never came, computed from the ticks and strides of those that came (Tally::record_gap).
  std::uint64_t frames_missed = 0;
  // The longest gap between two frames of an own character, where 1 means that none was missed, at any stride.
  std::uint64_t gap_ticks_max = 0;
  std::uint64_t frames_of_others = 0;
  // The frames whose bytes the decoder has refused.
  std::uint64_t frames_undecodable = 0;
  // The welcomes after a lost connection: with the former session, and with a new one.
  std::uint64_t resumes = 0, restarts = 0;
  std::uint64_t frames_discontinuous = 0;
  // The frames of own and other characters, by LevelIndex, and by index of kStrides.
  std::array<std::uint64_t, kLevelCount> frames_by_level{};
  std::array<std::uint64_t, kStrides.size()> frames_by_stride{};
  // The bytes of packets.
  std::uint64_t bytes_in = 0, bytes_out = 0;
  // The coded bytes of poses and hair in frames (FrameSeen::content_bytes).
  std::uint64_t content_bytes = 0;
  // The characters that joined and got their first frame, and those that never got one.
  std::uint64_t joins = 0, joins_unanswered = 0;
  // The samples of hands; both hands of a client are one sample.
  std::uint64_t hands_sent = 0;
  // The changes of props: each sets, moves or removes one.
  std::uint64_t props_sent = 0;
  // The holds that have caught points of hair, those that caught none or were ended by the server, and all caught
  // points.
  std::uint64_t holds = 0, holds_empty = 0, held_points = 0;
  // The sums over time of the clients and characters that were there. Divided by a duration they are mean numbers.
  double client_s = 0, character_s = 0;
  // The number of errors by reason.
  std::map<std::string, std::uint64_t, std::less<>> errors;
  // The key is "kind: reason".
  std::map<std::string, std::uint64_t, std::less<>> bad_client_ends;

  void add_error(std::string_view reason);
};

struct StageTally {
  Counts counts;
  // From a pose's intended capture to the arrival of the first frame sampled at or after it.
  LatencyHistogram latency;
  // From the sample time of a tick to the arrival of the tick's first frame at a client.
  LatencyHistogram frame_age;
  // From the sample time to the arrival, of every frame of other clients' characters.
  LatencyHistogram others_age;
  // From the arrival of a frame of another client's character to that of its next one.
  LatencyHistogram others_interval;
  // The difference between the time from one tick's first frame to the next tick's and the length of the ticks.
  LatencyHistogram jitter;
  // From the intended arrival of a character to its first frame.
  LatencyHistogram join;
  // From the intended capture of hands to the arrival, at another client, of hands sampled at or after it. Frames of
  // the hair that these hands move arrive at the same time.
  LatencyHistogram hands_latency;
  // From the intended time of a change of a prop to its arrival at another client of the room.
  LatencyHistogram props_latency;
  // From the time at which the generator intended to do something to the time at which it did.
  LatencyHistogram lag;
};

// A second or so of a run, for plots.
struct WindowFigures {
  double begin_s = 0, duration_s = 0;
  // The latencies of poses that were captured in the window.
  double latency_p50_ms = 0, latency_p99_ms = 0, latency_max_ms = 0;
  double lag_max_ms = 0;
  double clients = 0, characters = 0;
  std::uint64_t frames = 0, frames_missed = 0, bytes_in = 0, bytes_out = 0, content_bytes = 0, errors = 0;
  std::uint64_t poses_unanswered = 0, poses_unsent = 0;
  std::array<std::uint64_t, kLevelCount> frames_by_level{};
};

// Counts a run by stage and by window. An event counts in the stage and window in which it happens. The answer to a
// pose counts in those in which the pose was captured, however late the answer comes. Use it on one thread; all times
// are of one clock, which `begin_ns` is of too.
class Tally {
 public:
  Tally(const Plan& plan, std::int64_t begin_ns, std::int64_t window_ns = 1'000'000'000);

  void count(std::int64_t now_ns, std::uint64_t Counts::*which, std::uint64_t by = 1);
  void count_error(std::int64_t now_ns, std::string_view reason);
  void count_bad_client_end(std::int64_t now_ns, std::string_view kind, std::string_view reason);
  void record_answer(std::int64_t captured_ns, std::int64_t arrived_ns, std::uint64_t characters);
  // The poses captured at this time have got no answer until `now_ns`. The wait counts as their latency.
  void record_unanswered(std::int64_t captured_ns, std::int64_t now_ns, std::uint64_t characters);
  void record_join(std::int64_t intended_ns, std::int64_t now_ns, bool answered);
  void record_lag(std::int64_t intended_ns, std::int64_t now_ns);
  void record_frame(std::int64_t now_ns, LevelIndex level, std::uint32_t stride, std::size_t content_bytes,
                    bool discontinuous, bool own);
  // A frame of an own character has come `ticks` ticks after the frame before it. That one announced the next frame for
  // `stride` ticks later.
  void record_gap(std::int64_t now_ns, std::uint64_t ticks, std::uint32_t stride);
  void record_frame_age(std::int64_t sampled_ns, std::int64_t arrived_ns);
  // `before_ns` is the arrival of the same character's frame before; 0 when there was none or its hair was at rest.
  void record_frame_of_other(std::int64_t sampled_ns, std::int64_t arrived_ns, std::int64_t before_ns);
  void record_hands(std::int64_t captured_ns, std::int64_t arrived_ns);
  void record_props(std::int64_t sent_ns, std::int64_t arrived_ns);
  void record_jitter(std::int64_t now_ns, std::int64_t deviation_ns);
  // So many clients and characters have been there since the last call.
  void note_population(std::int64_t now_ns, std::size_t clients, std::size_t characters);
  // advance() closes the windows that are too old for late answers; finish() closes all of them.
  void advance(std::int64_t now_ns);
  void finish(std::int64_t now_ns);

  // Leaves out the stage's warm-up.
  [[nodiscard]] const StageTally& stage(std::size_t index) const { return stages_[2 * index + 1]; }
  [[nodiscard]] const std::vector<WindowFigures>& windows() const { return windows_; }
  // Returns the figures of the last window that is over, although some answers may still come. They are zero at first.
  [[nodiscard]] WindowFigures latest(std::int64_t now_ns) const;
  // Returns the generator's lag over the whole run.
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
  // The run has two parts for each stage, the warm-up and the rest. These are the ends of all parts.
  std::vector<std::int64_t> ends_ns_;
  // The tallies of the parts, and one more for events after the end of the run.
  std::vector<StageTally> stages_;
  // The part that the last call of at() was about.
  std::size_t newest_ = 0;
  LatencyHistogram lag_;
  // The number of windows in the whole run.
  std::int64_t window_count_max_ = 0;
  // The windows that still take events. The first of them has the number windows_.size().
  std::deque<Window> open_;
  // Takes the events after the end of the run, which nobody reads.
  Window after_;
  // The closed windows.
  std::vector<WindowFigures> windows_;
  // The time of the last call of note_population().
  std::int64_t population_ns_;
};

}  // namespace hairnet::load
