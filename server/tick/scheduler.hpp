#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "server/room/command.hpp"
#include "server/room/room.hpp"
#include "server/tick/recorder.hpp"
#include "server/tick/simulation.hpp"
#include "server/tick/tick_clock.hpp"
#include "server/tick/tick_counters.hpp"

namespace hairnet::server {

struct SchedulerDef {
  WorldDef world;
  std::uint32_t tick_rate_hz = 30;
  std::int64_t pose_delay_ns = 25'000'000;
};

// From poses to frames: one call a tick. Tick thread.
class Scheduler {
 public:
  // `recorder` may be null.
  Scheduler(const SchedulerDef& def, CommandQueue& commands, RoomCounters& room_counters, TickCounters& counters,
            Recorder* recorder);

  void run_tick(const TickClock::Tick& tick, std::int64_t now_ns);

  [[nodiscard]] const Simulation& simulation() const { return simulation_; }

 private:
  struct Taker;

  void take_commands(std::int64_t now_ns);
  void sample_poses();
  void choose_levels();
  void send_level_records(std::int64_t now_ns);
  void step();
  void record();

  void remove(CharacterKey key);
  void place(CharacterKey key, Character& character, const Pose& pose);
  void move(CharacterKey key, Character& character, const PoseInbox::Sample& sample, const Pose& pose);
  void send_level_record(CharacterKey key, const wire::GroomHash& groom, LevelIndex level, std::int64_t now_ns);
  void record_groom(const wire::GroomHash& groom);
  void mark_reset_lattices();
  void mark_level_switches();

  SchedulerDef def_;
  CommandQueue* commands_;
  TickCounters* counters_;
  Recorder* recorder_;
  Room room_;
  Simulation simulation_;
  std::vector<Command> taken_;
  wire::RecordedTick inputs_;                              // of the tick being made
  std::map<wire::GroomHash, Recorder::Bytes> unrecorded_;  // bytes of grooms that the recording does not hold yet
};

}  // namespace hairnet::server
