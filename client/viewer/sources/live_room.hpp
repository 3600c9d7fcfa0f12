#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "client/link/link.hpp"
#include "client/viewer/characters/load_characters.hpp"
#include "client/viewer/characters/options.hpp"
#include "client/viewer/sources/hair_source.hpp"
#include "client/viewer/sources/level_builder.hpp"
#include "client/viewer/sources/motion_timeline.hpp"
#include "client/viewer/sources/other_characters.hpp"
#include "client/viewer/sources/stream_statistics.hpp"

namespace hairnet::viewer {

// The room of a server: streams the poses of this client's own characters, and plays out the frames that come back,
// also those of other characters when they are observed. Own heads are shown where they are now (late latched), with
// the newest lattice that is played out; poses and lattices of others belong to one time. One thread beside the link's.
//
// All clips begin together at time 0: heads rest upright until every lattice has arrived.
class LiveRoom : public HairSource {
 public:
  // All arguments must outlive this. `tolerant`: a refusal by the server is noted and does not end the room.
  LiveRoom(const ViewOptions& options, const std::vector<CharacterSetup>& characters, bool tolerant);

  // Called for one frame of one character; `frame` has the client's own number, or 0 for other characters.
  using OnFrame = std::function<void(const link::Frame& frame, std::uint64_t tick, std::span<const Vec3f> displacement,
                                     std::uint64_t name)>;
  void on_frame(OnFrame call) { on_frame_ = std::move(call); }

  Result<void> open();
  // Handles what has arrived, and sends the poses that are due.
  Result<void> turn(std::int64_t now_ns);
  // Samples all play-outs at `now_ns`. `moment`: index of the moment to store, or negative.
  void play(std::int64_t now_ns, std::ptrdiff_t moment);

  [[nodiscard]] std::int64_t now_ns() const { return link_.now_ns(); }
  // Negative before the clips begin; none while their begin is not known.
  [[nodiscard]] std::optional<double> clip_time_s(std::int64_t now_ns) const;
  [[nodiscard]] std::vector<Moment> moments() const;  // of the own characters, as last shown
  [[nodiscard]] std::vector<SeenCharacter> others(std::size_t moment_count) const {
    return other_characters_.seen(moment_count);
  }
  // One line for each other member.
  [[nodiscard]] std::string members_summary() const { return other_characters_.summary(); }
  StreamStatistics& statistics() { return statistics_; }
  [[nodiscard]] link::LinkCounters counters() const { return link_.counters(); }
  [[nodiscard]] double latency_ms() const { return latency_ms_; }      // from pose to frame, of the last batch
  [[nodiscard]] const std::string& status() const { return status_; }  // one line; empty without a problem
  // Returns how large own and other characters appear, for the server's choice of detail.
  using Seen = std::function<wire::MemberImportance(const Pose& pose)>;
  void report_importance(const Seen& seen);
  // Null: no models of levels are needed.
  void set_level_builder(LevelBuilder* builder) { builder_ = builder; }

  Result<void> advance(std::int64_t now_ns) override;
  [[nodiscard]] std::span<const ViewedCharacter> viewed_characters() const override { return viewed_; }
  HeadGrab* grab(std::uint64_t id) override;
  void set_material(std::uint64_t id, const MaterialScale& scale) override;
  void set_level(std::uint64_t id, LevelIndex level) override;
  void teleport(std::uint64_t id) override;
  [[nodiscard]] const Wind& wind() const override { return wind_; }
  void set_wind(const Wind& wind) override;
  [[nodiscard]] bool paused() const override { return paused_; }
  void set_paused(bool paused) override { paused_ = paused; }

 private:
  // One of the own characters. Numbered from 1, in order.
  struct OwnCharacter {
    OwnCharacter(const Motion& motion, double duration_s, Loop loop) : timeline(motion, duration_s, loop) {}
    MotionTimeline timeline;
    wire::GroomHash groom{};
    std::uint32_t member = 0;  // 0: not known yet
    link::Playout playout;
    link::Playout::Sample sample;
    MaterialScale material;
    LevelIndex level_wanted = LevelIndex::high;
    HeadGrab grab;
    bool aside = false, teleport_pending = false;  // by teleport()
    bool at_level = false;                         // a frame at the requested level has arrived
    bool refused = false;                          // noted as refused: its lattice may never arrive
    std::optional<std::int64_t> first_lattice_ns;  // when its first lattice arrived
  };
  static link::LinkOptions link_options(const ViewOptions& options);
  Result<void> take_events();
  Result<void> take(const link::Disconnected& end);
  Result<void> take(const link::Connected& connected);
  Result<void> take(const link::Reconnecting& lost);
  Result<void> take(const wire::Error& error);
  Result<void> take(const wire::CharacterAdded& added);
  Result<void> take(const wire::MemberJoined& joined);
  Result<void> take(const wire::MemberChanged& changed);
  Result<void> take(const wire::MemberLeft& left);
  Result<void> take(const wire::RoomWind& told);
  Result<void> take(const link::GroomFetched& fetched);
  Result<void> take(const wire::GroomStatus& status);
  Result<void> take(const link::FrameBatch& batch);
  Result<void> take(const auto&) { return {}; }
  void take(const link::Frame& frame, const link::FrameBatch& batch, std::int64_t sampled_ns, std::int64_t now_ns);
  Result<void> refuse_or_note(const std::string& line);
  void note_refused(const wire::Error& error);
  void begin_when_ready(std::int64_t now_ns);
  [[nodiscard]] Pose pose_of(std::size_t own, double time_s) const;
  [[nodiscard]] double motion_time_s(std::int64_t now_ns) const;
  void push_poses(std::int64_t now_ns);
  void show(std::int64_t now_ns);
  [[nodiscard]] std::shared_ptr<const Level> model_of(const std::shared_ptr<const Groom>& groom,
                                                      const LevelGeometry* geometry) const;
  OwnCharacter* own_character(std::uint64_t id);

  const ViewOptions& options_;
  const std::vector<CharacterSetup>& characters_;
  const bool tolerant_;
  link::Link link_;
  OtherCharacters other_characters_{link_};
  std::vector<OwnCharacter> own_characters_;
  OnFrame on_frame_;
  StreamStatistics statistics_;
  LevelBuilder* builder_ = nullptr;
  std::vector<ViewedCharacter> viewed_;
  Wind wind_;
  bool paused_ = false;
  double paused_s_ = 0;  // total
  std::optional<std::int64_t> advanced_ns_;
  std::string status_ = "connecting";
  std::string transport_;  // of the last connection
  double latency_ms_ = 0;
  std::uint64_t session_ = 0;
  std::uint32_t sequence_ = 0;
  std::uint64_t pose_count_ = 0;
  std::int64_t opened_ns_ = 0;
  std::int64_t poses_begun_ns_ = 0, next_pose_ns_ = 0;  // pose_count_ poses have been sent since then
  std::optional<std::int64_t> zero_ns_;                 // the time at which the clips begin
  std::optional<std::int64_t> refused_ns_;
  double last_pose_s_ = -MotionTimeline::kLeadIn_s;
  std::vector<Vec3f> displacement_;
  std::mt19937 random_{1};
};

}  // namespace hairnet::viewer
