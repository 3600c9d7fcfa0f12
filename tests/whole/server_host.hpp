#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server/app/fleet.hpp"
#include "server/app/server.hpp"
#include "server/transport/admission.hpp"
#include "tests/whole/etcd_line.hpp"
#include "tests/whole/journal.hpp"
#include "tests/whole/network.hpp"

namespace hairnet::whole {

// One character at one tick in the server's World.
struct GroundTruth {
  LevelIndex level = LevelIndex::rigid;
  bool asleep = false, stepped = false;
  // The pose after it was encoded and decoded, so that it equals a frame's pose exactly.
  Pose pose;
  // The hair in the coefficients of its modes, before frames leave some out and round the others.
  std::vector<float> coefficients;
};

// A machine on which servers run, one after the other. Each run is a *life*, has a number from 0 on, and a clock of its
// own. The host calls the server's tasks as threads would, sometimes late, and notes the World's state at every tick,
// so that clients can compare their frames with it.
class ServerHost final : public Host {
 public:
  ServerHost(Timeline& timeline, Journal& journal, const server::Config& config, std::uint64_t seed);

  // Call it before start(). The host's servers then belong to the fleet that uses this etcd. `clock_rate` is the rate
  // of the machine's clock, where 1 is that of the timeline.
  void join_fleet(EtcdLine& line, double clock_rate);
  void start();
  // Ends the server. `how` says how the connections of its clients end.
  void kill(const ConnectionLoss& how);
  // Lets the server send a goodbye to all clients; call kill() later. In a fleet the server sends its clients to other
  // servers instead, and ends by itself.
  void drain();
  // The process of the server stands still until resume().
  void pause();
  void resume();
  // Notes no states, for long runs; truth() knows nothing then.
  void note_nothing() { notes_ = false; }
  void stall_tick(std::int64_t until_ns) { stalled_until_ns_ = until_ns; }
  // Sets the duration that the server measures for its work, for each reading of its clock: with a long one it must
  // lower levels.
  void set_work(std::int64_t reading_ns) { work_ns_ = reading_ns; }

  [[nodiscard]] bool is_up() const override { return server_ && drained_since_ns_ < 0; }
  [[nodiscard]] bool is_ended() const { return !server_; }
  [[nodiscard]] bool is_paused() const override { return is_paused_; }
  void wait_for_it(std::function<void()> action) override { waiting_.push_back(std::move(action)); }
  server::PacketSink* open(std::shared_ptr<SimulatedConnection> wire) override;
  [[nodiscard]] std::int64_t clock_ns() const override;
  [[nodiscard]] int life() const { return static_cast<int>(lives_.size()) - 1; }
  [[nodiscard]] const server::Server* server() const { return server_.get(); }
  // The number of connections that the server has not closed.
  [[nodiscard]] std::size_t connection_count() const { return lives_.back().admission->count(); }
  [[nodiscard]] const server::Metrics& metrics(int life) const {
    return *lives_[static_cast<std::size_t>(life)].metrics;
  }
  [[nodiscard]] const server::Config& config() const { return config_; }
  // In a fleet, while the server is up.
  [[nodiscard]] server::Directory& directory() { return fleet_->directory(); }
  [[nodiscard]] EtcdLineEnd& line_end() { return *line_end_; }
  // The moment of the timeline at which a server of that life had this time.
  [[nodiscard]] std::int64_t true_ns(int life, std::int64_t clock_ns) const;
  // Returns whether a server here had a reason to end sessions of the room since then: it was drained, stood still, or
  // has lost the room.
  [[nodiscard]] bool gave_up_since(const std::string& room, std::int64_t since_ns) const;
  // Hears at once of each room that a server owns now.
  std::function<void(const std::string& room, std::int64_t claim)> on_claimed;

  // Call it when all clients have left. Everything that the server still has of them is reported as a fault.
  void check_empty();
  void check_counts(int life);
  // Adds what the server of that life has counted to the events of the journal.
  void count_life(int life);

  // The state in that life; null when that tick never ran or did not have the character.
  [[nodiscard]] const GroundTruth* truth(int life, std::uint64_t tick, server::CharacterKey character) const;
  // Returns how much coarser the hair of that tick's frames may be than the session has asked for, since its connection
  // is throttled. Each octave doubles the error.
  [[nodiscard]] int coarser_octaves(int life, std::uint64_t tick, server::SessionId session) const;
  // The time at which a tick ran, on the timeline; negative: it was skipped.
  [[nodiscard]] std::int64_t ran_ns(int life, std::uint64_t tick) const;

 private:
  struct Tick {
    std::int64_t ran_ns = -1;
    std::map<server::CharacterKey, GroundTruth> characters;
    // The observers that are throttled after this tick, and by how many octaves.
    std::map<server::SessionId, int> coarser_octaves;
  };
  struct Life {
    std::unique_ptr<server::Metrics> metrics;
    std::shared_ptr<server::Admission> admission;
    std::int64_t clock_offset_ns = 0;
    std::vector<Tick> ticks;
  };
  // The counters of this life at a tick, from which check_rates() computes what has happened since.
  struct Rates {
    std::uint64_t tick = 0, winds = 0, rooms_opened = 0, rooms_closed = 0, place_choices = 0, welcomed = 0;
    // The number of observers at that tick.
    std::uint64_t observers = 0;
  };
  void start_in_fleet();
  void take(const server::FleetEvent& event, std::int64_t now_ns);
  void poll_fleet();
  void note_claims();
  // Runs the action now, or after resume() when the process stands still. It does nothing once that life has ended.
  template <class Action>
  void when_running(int life, Action action);
  void poll_io();
  void run_io(int life);
  void run_tick(int life);
  void run_builder(int life);
  void note_tick();
  void check_bounds();
  // Frames carry what the level's map gives, unless the level has changed a moment ago.
  void check_coefficients(std::uint64_t number, server::CharacterKey key, const LatticeView& lattice,
                          const GroundTruth& truth);
  void check_sessions(const server::SessionLimits& limits);
  void check_grooms();
  void check_rates();
  void check_shares();
  void fault(const std::string& what) { journal_->fault(name_, what); }

  Timeline* timeline_;
  Journal* journal_;
  server::Config config_;
  Random random_;
  std::vector<Life> lives_;
  std::string name_ = "server";
  // etcd of the fleet; null without a fleet.
  EtcdLine* line_ = nullptr;
  double clock_rate_ = 1;
  std::unique_ptr<EtcdLineEnd> line_end_;
  // The directory has news that is not yet taken.
  bool is_news_ = false;
  std::unique_ptr<server::Fleet> fleet_;
  std::unique_ptr<server::Server> server_;
  std::vector<std::weak_ptr<SimulatedConnection>> connections_;
  bool notes_ = true, is_paused_ = false;
  // What has reached the paused process. resume() runs it.
  std::vector<std::function<void()>> waiting_;
  // The number of the newest claim that this server has won, by room.
  std::map<std::string, std::int64_t> claims_;
  // The begin of the drain by this server's clock; it is negative while the server is not drained.
  std::int64_t drained_since_ns_ = -1;
  // The time on the timeline at which a server here was last drained or stood still.
  std::int64_t stopped_ns_ = -1;
  // The time at which a server here has last lost each room.
  std::map<std::string, std::int64_t> lost_ns_;
  // No tick runs before `stalled_until_ns_`. `work_ns_` is what set_work() was given.
  std::int64_t stalled_until_ns_ = 0, work_ns_ = 0;
  // The time that the builder's last job took.
  std::int64_t building_ns_ = 0;
  // The counters at the last check of rates.
  Rates rates_;
  // For pairs of subjects, few characters and many: the number of ticks in a row in which the first had less of the
  // tick's time for each character than the second (check_shares).
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> unfair_for_;
};

}  // namespace hairnet::whole
