#include "tests/whole/frame_gaps.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include "client/link/link_core.hpp"
#include "tests/whole/assets.hpp"
#include "tests/whole/server_host.hpp"

namespace hairnet::whole {
namespace {

// Within this time grooms are built and files are downloaded; nothing is measured.
constexpr std::int64_t kWarmUp_ns = 10 * kSecond_ns;
// Poses come at 72 Hz, as from a headset.
constexpr std::int64_t kPose_ns = kSecond_ns / 72;

// A client with a link core over one connection. Unlike Player it disturbs nothing.
class PlainClient final : public ClientEvents {
 public:
  PlainClient(Timeline& timeline, ServerHost& host, const NetworkQuality& quality, std::uint64_t address,
              std::uint64_t seed, std::string room = {})
      : timeline_(&timeline), core_(options(std::move(room))) {
    core_.start();
    core_.on_opening(timeline.now_ns());
    wire_ = std::make_shared<SimulatedConnection>(timeline, host, *this, quality, address, seed);
    wire_->connect(false);
    poll();
  }
  link::LinkCore& core() { return core_; }
  std::function<void(const link::FrameBatch&)> on_frames;

  void turn() {
    const std::int64_t now_ns = timeline_->now_ns();
    core_.poll(now_ns);
    while (wire_->takes_more()) {
      const std::vector<std::uint8_t> packet = core_.take_packet(now_ns);
      if (packet.empty()) break;
      const bool may_be_lost = core_.taken_may_be_lost() && packet.size() <= quic::kDatagramBytesMax;
      if (wire_->has_datagrams() && may_be_lost)
        wire_->write_datagram(packet);
      else
        wire_->write(packet);
    }
    for (const link::Event& event : core_.take_events()) {
      const auto* batch = std::get_if<link::FrameBatch>(&event);
      if (batch && on_frames) on_frames(*batch);
    }
  }
  void on_open() override {
    core_.on_open(timeline_->now_ns(), wire_->has_datagrams());
    turn();
  }
  void on_bytes(std::span<const std::uint8_t> bytes) override {
    core_.on_bytes(bytes, timeline_->now_ns());
    turn();
  }
  void on_datagram(std::span<const std::uint8_t> bytes) override {
    core_.on_packet(bytes, timeline_->now_ns());
    turn();
  }
  void on_download_packet(std::span<const std::uint8_t> packet) override { on_datagram(packet); }
  void on_room() override { turn(); }
  void on_closed(const std::string&) override {}

 private:
  static link::LinkCoreOptions options(std::string room) {
    link::LinkCoreOptions options;
    options.room = std::move(room);
    options.evaluate_learnt = false;
    return options;
  }
  void poll() {
    turn();
    timeline_->after(kSecond_ns / 4, [this] { poll(); });
  }

  Timeline* timeline_;
  link::LinkCore core_;
  std::shared_ptr<SimulatedConnection> wire_;
};

// Heads that turn and sway all the time, 60 cm apart, each with a phase of its own.
Pose lively_pose(double t, std::uint32_t character) {
  const double phase = 0.7 * character;
  const Quat turn(Eigen::AngleAxisd(0.7 * std::sin(5 * t + phase), Vec3(0.3, 1, 0.2).normalized()));
  return rigid_pose({turn, {0.6 * character + 0.1 * std::sin(4 * t + phase), 1.6, 0.1 * std::cos(3 * t)}});
}

}  // namespace

Gaps measure_gaps(const GapsDef& def, std::uint64_t seed) {
  seed_secrets(seed);
  Timeline timeline;
  Journal journal(seed, timeline);
  server::Config config;
  config.tick_rate_hz = 30;
  config.workers = config.build_threads = 1;
  config.sessions.characters_per_session_max = config.sessions.characters_per_subject_max = 64;
  config.grooms.learning = server::Learning::never;
  ServerHost host(timeline, journal, config, seed);
  host.note_nothing();
  host.start();

  PlainClient owner(timeline, host, {}, 1, seed);
  NetworkQuality lossy;
  lossy.set_lossy(def.path, def.path, def.has_datagrams);
  PlainClient viewer(timeline, host, lossy, 2, seed + 1'000'000);
  wire::Observe observe;
  // The hair of these grooms is small. Without rounding its frames are as large as those of other hair.
  observe.error_m = 0;
  viewer.core().send(observe);
  const Assets::GroomFile& groom = assets().grooms[0];
  owner.core().offer_groom(groom.hash, groom.bytes);
  for (std::uint32_t c = 1; c <= def.characters; ++c)
    owner.core().send(wire::AddCharacter{c, groom.hash, LevelIndex::high, {}});
  // The owner has a perfect line, so each gap that the viewer sees comes from the viewer's line. The mover sends poses
  // over such a line to a room of its own, and shows how many of them get lost.
  PlainClient mover(timeline, host, lossy, 3, seed + 2'000'000, "next-door");
  mover.core().offer_groom(groom.hash, groom.bytes);
  mover.core().send(wire::AddCharacter{1, groom.hash, LevelIndex::high, {}});
  std::uint32_t sequence = 0;
  std::function<void()> pose = [&] {
    std::vector<wire::PoseSample> poses;
    ++sequence;
    const std::int64_t now_ns = timeline.now_ns();
    for (std::uint32_t c = 1; c <= def.characters; ++c)
      poses.push_back({c, sequence, now_ns, false, lively_pose(1e-9 * static_cast<double>(now_ns), c)});
    mover.core().push_poses({poses.front()});
    mover.turn();
    owner.core().push_poses(std::move(poses));
    owner.turn();
    timeline.after(kPose_ns, pose);
  };
  pose();

  Gaps gaps;
  std::map<std::uint32_t, std::int64_t> last_ns;
  viewer.on_frames = [&](const link::FrameBatch& batch) {
    const std::int64_t now_ns = timeline.now_ns();
    for (const link::Frame& frame : batch.frames) {
      const auto [last, is_first] = last_ns.try_emplace(frame.member, now_ns);
      if (now_ns > kWarmUp_ns && !is_first)
        gaps.ms.push_back(static_cast<float>(1e-6 * static_cast<double>(now_ns - last->second)));
      last->second = now_ns;
    }
  };
  timeline.run(kWarmUp_ns);
  const std::uint64_t bytes = viewer.core().counters().frame_bytes_received;
  // The counters from here on say how many poses of the owner and the mover are missing or late.
  const server::RoomCounters& counters = host.metrics(0).room;
  const auto late = [&] { return counters.poses_extrapolated.value() + counters.poses_stale.value(); };
  const std::uint64_t first_sequence = sequence, came = counters.poses_accepted.value(), came_late = late();
  const std::int64_t end_ns = kWarmUp_ns + static_cast<std::int64_t>(1e9 * def.duration_s);
  std::size_t looks = 0, coarser = 0;
  while (timeline.now_ns() < end_ns) {
    timeline.run(std::min(end_ns, timeline.now_ns() + kSecond_ns / 10));
    for (const auto& [session, observer] : host.server()->scheduler().rooms().observers()) {
      // The first session is the owner's, whose line is perfect.
      if (observer.session == 1) continue;
      ++looks;
      coarser += observer.throttle.coarser_octaves() > 0 ? 1 : 0;
    }
  }
  const double pushed = (1.0 + def.characters) * static_cast<double>(sequence - first_sequence);
  const double missing = pushed - static_cast<double>(counters.poses_accepted.value() - came);
  gaps.poses_missing_share = missing / static_cast<double>(sequence - first_sequence);
  gaps.poses_late_share = static_cast<double>(late() - came_late) / (config.tick_rate_hz * def.duration_s);
  gaps.frame_bytes_per_s = static_cast<double>(viewer.core().counters().frame_bytes_received - bytes) / def.duration_s;
  gaps.coarser_share = static_cast<double>(coarser) / static_cast<double>(std::max<std::size_t>(looks, 1));
  std::ranges::sort(gaps.ms);
  return gaps;
}

}  // namespace hairnet::whole
