#include "client/tools/view/stream.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>
#include <random>
#include <string>
#include <thread>

#include "client/link/playout.hpp"
#include "client/tools/progress/progress_bar.hpp"
#include "client/tools/trace/frame_trace.hpp"
#include "client/tools/view/audience.hpp"
#include "client/tools/view/performance.hpp"
#include "client/tools/view/switch_trail.hpp"

namespace hairnet::viewer {
namespace {

constexpr std::int64_t kLoop_ns = 1'000'000;
constexpr std::int64_t kPlayInterval_ns = 8'000'000;  // how often a display would ask for a picture
constexpr std::int64_t kUprightLeast_ns = 1'000'000'000;
constexpr std::int64_t kGroomsReady_ns_max = 600'000'000'000;
constexpr std::int64_t kCoarser_ns = 3'000'000'000;      // at a coarser level for so long: the server gives no more
constexpr std::int64_t kRefusalDetail_ns = 500'000'000;  // within which an error says why a groom was refused

std::int64_t to_ns(double seconds) {
  return static_cast<std::int64_t>(std::llround(seconds * 1e9));
}

std::string plain(const wire::Error& error) {
  std::string text = std::string("the server refuses: ") + wire::to_string(error.reason);
  if (error.character != 0) text += ", character " + std::to_string(error.character);
  return error.detail.empty() ? text : text + " (" + error.detail + ")";
}

// The stream while it runs. Characters are numbered from 1, in the order of the cast.
class Streamer {
 public:
  Streamer(const ViewOptions& options, const std::vector<Actor>& cast, const std::vector<double>& moment_times_s)
      : options_(options), cast_(cast), moment_times_s_(moment_times_s), link_(link_options(options)) {
    for (const Actor& actor : cast)
      roles_.push_back({Performance(actor.motion, options.duration_s), {}, {}, {}, false, {}});
  }

  StreamResult run() {
    result_.ended = open();
    if (result_.ended) result_.ended = perform();
    result_.statistics.take_counters(link_.counters());
    result_.others = audience_.seen(result_.moments.size());
    if (trace_) {
      const Result<void> finished = trace_->finish();
      if (result_.ended) result_.ended = finished;
    }
    return std::move(result_);
  }

 private:
  struct Role {
    Performance performance;
    wire::GroomHash groom{};
    link::Playout playout;
    SwitchTrail trail;
    bool at_level = false;                   // a frame at the level asked for has come
    std::optional<std::int64_t> coarser_ns;  // since when there is a lattice, of a level that the server chose
  };

  static link::LinkOptions link_options(const ViewOptions& options) {
    link::LinkOptions link;
    link.server = options.server;
    link.tls = options.tls;
    link.core.client_name = "hairnet-view";
    link.core.room = options.room;
    link.core.token = options.token;
    if (options.characters.empty()) link.core.role = wire::Role::observer;
    link.core.reconnect = options.reconnect_s > 0;
    link.core.give_up_after_s = options.reconnect_s;
    return link;
  }

  // One's own characters alone.
  static wire::Observe nobody() {
    wire::Observe observe;
    observe.mode = wire::ObserveMode::list;
    return observe;
  }

  Result<void> open() {
    if (!options_.trace.empty()) {
      Result<FrameTrace> trace = FrameTrace::create(options_.trace);
      if (!trace) return Refusal(trace.error());
      trace_ = std::move(*trace);
    }
    const Result<wire::Welcome> welcome = link_.connect();
    if (!welcome) return Refusal(welcome.error());
    session_ = welcome->session;
    for (std::size_t i = 0; i < cast_.size(); ++i) {
      const auto same = std::find_if(cast_.begin(), cast_.begin() + static_cast<std::ptrdiff_t>(i),
                                     [&](const Actor& a) { return a.groom == cast_[i].groom; });
      const auto first = static_cast<std::size_t>(same - cast_.begin());
      roles_[i].groom = first == i ? link_.upload(*cast_[i].groom) : roles_[first].groom;
      const auto character = static_cast<std::uint32_t>(i + 1);
      link_.add_character(character, roles_[i].groom, cast_[i].level);
      if (cast_[i].material)
        link_.set_material(character, scale_between(cast_[i].groom->materials.base, *cast_[i].material));
    }
    if (options_.wind) link_.set_wind(*options_.wind);
    link_.observe(options_.observe.value_or(nobody()));
    return {};
  }

  // Everything that happens in real time.
  Result<void> perform() {
    ProgressBar bar("hairnet-view");
    opened_ns_ = next_pose_ns_ = link_.now_ns();
    const std::int64_t length_ns = to_ns(options_.duration_s + options_.settle_s);
    while (true) {
      if (const Result<void> taken = take_events(); !taken) return taken;
      const std::int64_t now = link_.now_ns();
      if (!zero_ns_) begin_when_ready(now);
      if (refused_ns_ && now - *refused_ns_ > kRefusalDetail_ns) return Refusal("the server refuses a groom");
      if (!zero_ns_ && now - opened_ns_ > kGroomsReady_ns_max) return Refusal("the lattices never arrived");
      if (now >= next_pose_ns_) push_poses(now);
      if (now >= next_play_ns_) play(now);
      if (zero_ns_ && now >= *zero_ns_ + length_ns && result_.moments.size() == moment_times_s_.size()) return {};
      show_progress(bar, now, length_ns);
      std::this_thread::sleep_for(std::chrono::nanoseconds(kLoop_ns));
    }
  }

  Result<void> take_events() {
    for (link::Event& event : link_.poll()) {
      const Result<void> taken = std::visit([this](auto& e) { return take(e); }, event);
      if (!taken) return taken;
    }
    return {};
  }
  Result<void> take(const link::Disconnected& end) { return Refusal(end.detail); }
  Result<void> take(const link::Connected& connected) {
    session_ = connected.welcome.session;
    return {};
  }
  Result<void> take(const link::Reconnecting& lost) {
    std::fprintf(stderr, "hairnet-view: %s; connecting anew\n", lost.detail.c_str());
    for (Role& role : roles_) role.playout.hold();
    audience_.hold();
    return {};
  }
  Result<void> take(const wire::Error& error) {
    if (error.reason == wire::ErrorReason::state_invalid) return {};  // the hair starts at rest
    const bool may_come_later =
        error.reason == wire::ErrorReason::groom_unavailable || error.reason == wire::ErrorReason::limit_exceeded;
    return may_come_later && audience_.retry(error.groom, link_.now_ns()) ? Result<void>() : Refusal(plain(error));
  }
  Result<void> take(const wire::MemberJoined& joined) {
    if (options_.observe) audience_.take(joined);
    return {};
  }
  Result<void> take(const wire::MemberLeft& left) {
    audience_.take(left);
    return {};
  }
  Result<void> take(const link::GroomFetched& fetched) { return audience_.take(fetched); }
  Result<void> take(const wire::GroomStatus& status) {
    if (status.state == wire::GroomState::refused) refused_ns_ = link_.now_ns();
    return {};
  }
  Result<void> take(const link::FrameBatch& batch) {
    const std::int64_t now = link_.now_ns(), sampled = link_.to_local_ns(batch.sample_time_ns);
    result_.statistics.count_frames(batch, now - sampled);
    for (const link::Frame& frame : batch.frames) take(frame, batch, sampled, now);
    return {};
  }
  void take(const link::Frame& frame, const link::FrameBatch& batch, std::int64_t sampled, std::int64_t now) {
    codec::dequantise_nodes(frame.displacements, frame.error_class, displacement_);
    if (frame.character == 0) {
      if (audience_.push(frame, sampled, now)) trace(audience_.name_of(frame.member), frame, batch.tick);
      return;
    }
    Role& role = roles_[frame.character - 1];
    role.at_level = role.at_level || frame.level == cast_[frame.character - 1].level;
    if (!role.coarser_ns && frame.level != LevelIndex::rigid) role.coarser_ns = now;
    role.playout.push(frame, sampled, now);
    result_.statistics.count_displacement(frame.character, displacement_);
    trace(session_ << 32 | frame.character, frame, batch.tick);
  }
  void trace(std::uint64_t character, const link::Frame& frame, std::uint64_t tick) {
    if (!trace_) return;
    const bool rigid = frame.kept || displacement_.empty();  // as the server sent it
    const float step_m = rigid ? 0 : codec::kStep_m[static_cast<std::size_t>(frame.error_class)];
    trace_->add({tick, character, frame.kept ? LevelIndex::rigid : frame.level, frame.discontinuous, frame.asleep,
                 step_m, frame.pose, rigid ? std::span<const Vec3f>() : displacement_, frame.step_stride});
  }
  Result<void> take(const auto&) { return {}; }

  // The clips begin together, once every character is simulated at its level.
  void begin_when_ready(std::int64_t now) {
    const bool ready = std::all_of(roles_.begin(), roles_.end(), [&](const Role& role) {
      return role.at_level || (role.coarser_ns && now - *role.coarser_ns > kCoarser_ns);
    });
    if (ready && now >= opened_ns_ + kUprightLeast_ns) zero_ns_ = now + to_ns(Performance::kLeadIn_s);
  }

  [[nodiscard]] double time_s(std::int64_t ns) const {
    return zero_ns_ ? 1e-9 * static_cast<double>(ns - *zero_ns_) : -Performance::kLeadIn_s;
  }

  void push_poses(std::int64_t now) {
    const double to_s = time_s(now);
    std::vector<wire::PoseSample> poses;
    ++sequence_;
    for (std::size_t i = 0; i < roles_.size(); ++i) {
      wire::PoseSample sample;
      sample.character = static_cast<std::uint32_t>(i + 1);
      sample.sequence = sequence_;
      sample.capture_time_ns = now;
      sample.teleport = roles_[i].performance.jumps(last_pose_s_, to_s);
      sample.pose = rounded_to_wire(roles_[i].performance.at(to_s));
      poses.push_back(sample);
    }
    last_pose_s_ = to_s;
    result_.statistics.count_poses(poses.size());
    link_.push_poses(std::move(poses));

    ++pose_count_;
    const double jitter_s = 1e-3 * options_.jitter_ms * std::uniform_real_distribution<>(-1, 1)(random_);
    next_pose_ns_ = opened_ns_ + to_ns(static_cast<double>(pose_count_) / options_.pose_rate_hz + jitter_s);
  }

  // Samples as a display would, so that play-out keeps time, and copies out the wanted moments.
  void play(std::int64_t now) {
    next_play_ns_ = now + kPlayInterval_ns;
    const bool wanted = zero_ns_ && result_.moments.size() < moment_times_s_.size() &&
                        time_s(now) >= moment_times_s_[result_.moments.size()];
    std::vector<Moment> moment;
    for (Role& role : roles_) {
      const link::Playout::Sample sample = role.playout.sample(now);
      if (!sample.valid) continue;
      role.trail.note(sample);
      if (wanted) moment.push_back(role.trail.moment(sample.pose));
    }
    audience_.play(now, wanted ? static_cast<std::ptrdiff_t>(result_.moments.size()) : -1);
    if (wanted) result_.moments.push_back(std::move(moment));
  }

  void show_progress(ProgressBar& bar, std::int64_t now, std::int64_t length_ns) const {
    if (!zero_ns_) return bar.show(0, "waiting for the lattices");
    bar.show(static_cast<double>(now - *zero_ns_) / static_cast<double>(length_ns), "streaming");
  }

  const ViewOptions& options_;
  const std::vector<Actor>& cast_;
  const std::vector<double>& moment_times_s_;
  link::Link link_;
  Audience audience_{link_};
  std::optional<FrameTrace> trace_;
  std::vector<Role> roles_;
  StreamResult result_;
  std::uint64_t session_ = 0;
  std::uint32_t sequence_ = 0;
  std::uint64_t pose_count_ = 0;
  std::int64_t opened_ns_ = 0, next_pose_ns_ = 0, next_play_ns_ = 0;
  std::optional<std::int64_t> zero_ns_;  // when the clips begin
  std::optional<std::int64_t> refused_ns_;
  double last_pose_s_ = -Performance::kLeadIn_s;
  std::vector<Vec3f> displacement_;
  std::mt19937 random_{1};
};

}  // namespace

StreamResult stream(const ViewOptions& options, const std::vector<Actor>& cast,
                    const std::vector<double>& moment_times_s) {
  return Streamer(options, cast, moment_times_s).run();
}

}  // namespace hairnet::viewer
