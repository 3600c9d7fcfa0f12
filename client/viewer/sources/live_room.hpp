#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "client/link/link.hpp"
#include "client/room/room.hpp"
#include "client/viewer/characters/load_characters.hpp"
#include "client/viewer/characters/options.hpp"
#include "client/viewer/sources/hair_source.hpp"
#include "client/viewer/sources/level_builder.hpp"
#include "client/viewer/sources/moment.hpp"
#include "client/viewer/sources/motion_timeline.hpp"
#include "client/viewer/sources/stream_statistics.hpp"

namespace hairnet::viewer {

// Another client's character at the moments that pictures need, which are drawn after the stream has ended. It has no
// entry at moments when it was absent or its hair was not here.
struct SeenCharacter {
  // The member as it was last: its name and colours may have changed in between.
  std::shared_ptr<const room::Member> member;
  std::shared_ptr<const Groom> groom;
  // One entry for each moment of the stream.
  std::vector<std::optional<Moment>> moments;
};

// The room of a server as the viewer shows it. It moves this client's own characters by their clips, and keeps the
// moments that pictures need. Own heads are shown at their newest pose (late latching), with the newest lattice that is
// played out; pose and lattice of another client's character belong to one time. The Room below it reconnects, uploads
// and plays out. One thread, beside the link's.
// All clips begin together at time 0: heads rest upright until every lattice has arrived.
class LiveRoom : public HairSource, private room::FrameObserver {
 public:
  // `options` and `characters` must outlive this. `tolerant`, which a window wants: a refusal by the server is shown in
  // status(), and does not end the room.
  LiveRoom(const ViewOptions& options, const std::vector<CharacterSetup>& characters, bool tolerant);

  // Called for one frame of one character. `member.own` is the client's own number, or 0 for other characters;
  // `displacement` is in active order, head space, m, and valid during the call.
  using OnFrame = std::function<void(const link::Frame& frame, std::uint64_t tick, std::span<const Vec3f> displacement,
                                     const room::Member& member)>;
  void on_frame(OnFrame call) { on_frame_ = std::move(call); }

  // Connects, which blocks, then adds the characters. Call it once, before all else.
  Result<void> open();
  // Sends the poses that are due, at the rate of the options. Call it more often than that.
  void send_poses(std::int64_t now_ns);
  // Takes what has arrived, and moves everyone to this moment. The error is one line why the room has ended.
  Result<void> play();
  // Stores the characters of others as they are shown now. `moment` is the index of the moment, from 0.
  void keep(std::size_t moment);

  [[nodiscard]] std::int64_t now_ns() const { return link_->now_ns(); }
  // The time of the clips, s: negative before they begin; none while their begin is not known.
  [[nodiscard]] std::optional<double> clip_time_s(std::int64_t now_ns) const;
  // The own characters as they are shown now, in the order of the options. Characters that were never shown are left
  // out.
  [[nodiscard]] std::vector<Moment> moments() const;
  // The characters of others whose hair was stored at one moment or more. `moment_count` is the number of all moments.
  [[nodiscard]] std::vector<SeenCharacter> others(std::size_t moment_count) const;
  // One line for each other member: its name, whose it is and its colours.
  [[nodiscard]] std::string members_summary() const;
  StreamStatistics& statistics() { return statistics_; }
  [[nodiscard]] link::LinkCounters counters() const { return link_->counters(); }
  // Returns the last batch's latency, from pose to frame, ms.
  [[nodiscard]] double latency_ms() const { return latency_ms_; }
  // One line for people; empty without a problem.
  [[nodiscard]] const std::string& status() const { return status_; }
  // Returns how large a character appears on the screen, for the server's choice of detail.
  using Seen = std::function<wire::MemberImportance(const Pose& pose)>;
  void report_importance(const Seen& seen);
  // `builder` must outlive this. Null: no models of levels are needed, and none are built.
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
  // One of the own characters. They are in the order of the options; the room numbers them from 1.
  struct OwnCharacter {
    OwnCharacter(const Motion& motion, double duration_s, Loop loop) : timeline(motion, duration_s, loop) {}
    MotionTimeline timeline;
    // This client's own number for it in the room.
    std::uint32_t number = 0;
    // The member as it was last in the room: while a new server has not announced it, its hair stays as it was, and its
    // head goes on.
    std::shared_ptr<const room::Member> member;
    MaterialScale material;
    LevelIndex level_wanted = LevelIndex::high;
    HeadGrab grab;
    // These are set by teleport(): where the character stands, and that the next pose jumps.
    bool aside = false, teleport_pending = false;
    // A frame at the requested level has arrived.
    bool at_level = false;
    // The server has refused the character or its groom: its lattice may never arrive, so the clips do not wait for it.
    bool refused = false;
    // The time at which the character's first lattice arrived.
    std::optional<std::int64_t> first_lattice_ns;
  };
  static link::LinkOptions link_options(const ViewOptions& options);
  Result<void> take_events();
  Result<void> take(const room::StateChanged& changed);
  Result<void> take(const room::Joined& joined);
  Result<void> take(const room::Left& left);
  Result<void> take(const room::WindChanged& changed);
  Result<void> take(const room::Error& error);
  Result<void> take(const auto&) { return {}; }
  void on_batch(const link::FrameBatch& batch, std::int64_t sampled_ns, std::int64_t now_ns) override;
  void on_frame(const link::FrameBatch& batch, const link::Frame& frame, const room::Member& member) override;
  // Returns the line as an error, or shows it in status() if this is tolerant.
  Result<void> refuse_or_note(const std::string& line);
  void note_refused(const room::Error& error);
  [[nodiscard]] std::shared_ptr<const room::Member> member_of(std::size_t own) const {
    return own_characters_[own].member;
  }
  // Sets the time at which the clips begin, once the lattices are there.
  void begin_when_ready(std::int64_t now_ns);
  [[nodiscard]] Pose pose_of(std::size_t own, double time_s) const;
  [[nodiscard]] double motion_time_s(std::int64_t now_ns) const;
  void show(std::int64_t now_ns);
  [[nodiscard]] std::shared_ptr<const Level> model_of(const std::shared_ptr<const Groom>& groom,
                                                      const LevelGeometry* geometry) const;
  OwnCharacter* own_character(std::uint64_t id);

  const ViewOptions& options_;
  const std::vector<CharacterSetup>& characters_;
  const bool tolerant_;
  std::unique_ptr<room::Room> room_;
  // The conversation of room_, which owns it.
  link::Link* link_;
  std::vector<OwnCharacter> own_characters_;
  // The stored moments of others, by the index of the moment.
  std::map<std::shared_ptr<const room::Member>, std::map<std::size_t, Moment>> kept_;
  OnFrame on_frame_;
  StreamStatistics statistics_;
  LevelBuilder* builder_ = nullptr;
  std::vector<ViewedCharacter> viewed_;
  Wind wind_;
  bool paused_ = false;
  // The total time of pauses, which the clips' time leaves out.
  double paused_s_ = 0;
  // The time of the last advance().
  std::optional<std::int64_t> advanced_ns_;
  std::string status_ = "connecting";
  // The transport of the last connection, so that only a change is printed.
  std::string transport_;
  double latency_ms_ = 0;
  // The number of calls of send_poses() that sent poses since poses_begun_ns_.
  std::uint64_t pose_count_ = 0;
  // The time at which open() had added the characters.
  std::int64_t opened_ns_ = 0;
  // The times of the poses count from poses_begun_ns_, which a stall sets again. The next pose is due at next_pose_ns_.
  std::int64_t poses_begun_ns_ = 0, next_pose_ns_ = 0;
  // The time at which the clips begin; none while lattices are awaited.
  std::optional<std::int64_t> zero_ns_;
  // The time of a refusal whose reason should still come.
  std::optional<std::int64_t> refused_ns_;
  // The time of the clips at the last pose.
  double last_pose_s_ = -MotionTimeline::kLeadIn_s;
  std::vector<Vec3f> displacement_;
  // The random jitter of the poses. The seed is fixed, so that runs can be repeated.
  std::mt19937 random_{1};
};

}  // namespace hairnet::viewer
