#include "client/viewer/offline/stream.hpp"

#include <algorithm>
#include <chrono>
#include <optional>
#include <thread>

#include "client/files/frame_trace.hpp"
#include "client/tools/command_line/progress_bar.hpp"
#include "client/tools/command_line/stop_signal.hpp"
#include "client/viewer/sources/live_room.hpp"

namespace hairnet::viewer {
namespace {

// The loop's pause: poses are late by at most about this much.
constexpr std::int64_t kLoop_ns = 1'000'000;
// Frames are played out at this interval, as for a display of 125 Hz. Play-out keeps its time by the calls, so they
// must come as often as from a display.
constexpr std::int64_t kPlayInterval_ns = 8'000'000;

// A room that is streamed to without a window.
class Streamer {
 public:
  // A refusal ends this stream: a measurement without its characters would mislead.
  Streamer(const ViewOptions& options, const std::vector<CharacterSetup>& characters,
           const std::vector<double>& moment_times_s)
      : options_(options), moment_times_s_(moment_times_s), room_(options, characters, false) {
    // The interval is half of the time of a picture, so that each picture of a fast video has its own time.
    if (options.output == Output::video)
      play_interval_ns_ = std::min(play_interval_ns_, static_cast<std::int64_t>(0.5e9 / options.frame_rate_hz));
  }

  StreamResult run() {
    // Statistics and counters are taken also after a failure: they say how far it came.
    result_.ended = open();
    result_.connected = result_.ended.has_value();
    if (result_.ended) result_.ended = perform();
    room_.statistics().take_counters(room_.counters());
    result_.statistics = room_.statistics();
    result_.members = room_.members_summary();
    result_.others = room_.others(result_.moments.size());
    // A stream that failed still has a whole trace until then; its own error counts first.
    if (trace_) {
      const Result<void> finished = trace_->finish();
      if (result_.ended) result_.ended = finished;
    }
    return std::move(result_);
  }

 private:
  Result<void> open() {
    if (!options_.trace.empty()) {
      Result<FrameTrace> trace = FrameTrace::create(options_.trace);
      if (!trace) return Refusal(trace.error());
      trace_ = std::move(*trace);
      room_.on_frame([this](const link::Frame& frame, std::uint64_t tick, std::span<const Vec3f> displacement,
                            const room::Member& member) { add_to_trace(frame, tick, displacement, member); });
    }
    return room_.open();
  }

  void add_to_trace(const link::Frame& frame, std::uint64_t tick, std::span<const Vec3f> displacement,
                    const room::Member& member) {
    // A member's number changes when it joins again; session and its owner's number name a character for all clients.
    const std::uint64_t name = member.session << 32 | member.owners_character;
    // The trace has what the server sent: the last known hair from before a reconnect is no frame.
    const bool rigid = frame.last_known || displacement.empty();
    trace_->add({tick, name, frame.last_known ? LevelIndex::rigid : frame.level, frame.discontinuous, frame.asleep,
                 frame.pose, rigid ? std::span<const Vec3f>() : displacement, frame.step_stride});
  }

  // Runs everything that happens in real time. Poses come first: they must keep their rate while frames are played out.
  Result<void> perform() {
    ProgressBar bar("hairnet-view");
    const double length_s = options_.duration_s + options_.settle_s;
    while (true) {
      const std::int64_t now = room_.now_ns();
      room_.send_poses(now);
      if (now >= next_play_ns_) {
        if (Result<void> played = play(now); !played) return played;
      }
      const std::optional<double> time_s = room_.clip_time_s(now);
      // The last moment may come after the end: play-out samples at intervals.
      if (time_s && *time_s >= length_s && result_.moments.size() == moment_times_s_.size()) return {};
      if (stop_requested()) {
        result_.stopped = true;
        return {};
      }
      if (!time_s)
        bar.show(0, "waiting for the lattices");
      else
        bar.show(*time_s / length_s, "streaming");
      std::this_thread::sleep_for(std::chrono::nanoseconds(kLoop_ns));
    }
  }

  // Samples like a display, so that play-out keeps time, and copies out the wanted moments. Nothing is drawn meanwhile.
  Result<void> play(std::int64_t now) {
    next_play_ns_ = now + play_interval_ns_;
    if (Result<void> played = room_.play(); !played) return played;
    const std::optional<double> time_s = room_.clip_time_s(now);
    // After a stall more than one moment may be due. All of these get the same late state, so that a video keeps its
    // speed.
    for (std::size_t next = result_.moments.size();
         time_s && next < moment_times_s_.size() && *time_s >= moment_times_s_[next]; ++next) {
      // Own and other characters have the same moment.
      room_.keep(next);
      result_.moments.push_back(room_.moments());
    }
    return {};
  }

  const ViewOptions& options_;
  const std::vector<double>& moment_times_s_;
  LiveRoom room_;
  std::optional<FrameTrace> trace_;
  StreamResult result_;
  std::int64_t play_interval_ns_ = kPlayInterval_ns, next_play_ns_ = 0;
};

}  // namespace

StreamResult stream(const ViewOptions& options, const std::vector<CharacterSetup>& characters,
                    const std::vector<double>& moment_times_s) {
  return Streamer(options, characters, moment_times_s).run();
}

}  // namespace hairnet::viewer
