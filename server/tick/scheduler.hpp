#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "core/world/simulation.hpp"
#include "schema/wire/recording.hpp"
#include "server/exchange/command.hpp"
#include "server/room/interest.hpp"
#include "server/room/room.hpp"
#include "server/tick/level_chooser.hpp"
#include "server/tick/publish.hpp"
#include "server/tick/recorder.hpp"
#include "server/tick/tick_clock.hpp"
#include "server/tick/tick_counters.hpp"
#include "server/tick/touch.hpp"

namespace hairnet::server {

struct SchedulerDef {
  WorldDef world;
  PublishDef publish;
  LevelChooserDef levels;
  // Every room has this wind until one of its clients sets another.
  Wind wind;
  std::uint32_t tick_rate_hz = 30;
  // Poses are sampled this long before the tick's due time, so that most samples lie between two received poses.
  std::int64_t pose_delay_ns = 25'000'000;
  // A room goes on existing for this long after all have left.
  std::int64_t room_grace_ns = 10'000'000'000;
  // Bounds all rooms, empty ones included.
  std::size_t room_count_max = 4096;
  // Bounds all hair states that wait for their levels.
  std::size_t state_bytes_max = std::size_t{256} << 20;
};

// Makes frames of poses. One call of run_tick() makes one tick: it runs the commands of sessions, samples poses,
// chooses levels, steps the World and sends frames. The only clock is `world.now_ns`, which measures the duration of
// work; with a null clock the same commands give the same frames. The scheduler owns rooms, characters and the World,
// and nothing else changes them. Tick thread.
class Scheduler {
 public:
  // `recorder` may be null. The queue and the counters must outlive it. A substep count of 0 is replaced by the one
  // that the tick rate needs, and a missing parallel_for by a serial loop.
  Scheduler(const SchedulerDef& def, CommandQueue& commands, RoomCounters& room_counters, TickCounters& counters,
            Recorder* recorder);

  // `tick` has the due time, at which poses are sampled; `now_ns` is the present, which stamps messages. They differ
  // when a tick is late.
  void run_tick(const TickClock::Tick& tick, std::int64_t now_ns);

  [[nodiscard]] const Simulation& simulation() const { return simulation_; }
  [[nodiscard]] const Rooms& rooms() const { return rooms_; }

 private:
  // Runs one command; defined in scheduler_commands.cpp.
  struct CommandHandler;

  // These three go on telling sessions that have joined or resumed who is in their room: all such sessions in turn, one
  // session, one member. Limits of one tick (scheduler_commands.cpp) cut the work, and later ticks go on with it.
  void announce_members(std::int64_t now_ns);
  void announce_members(Observer& observer, std::int64_t now_ns);
  static void announce(const Observer& observer, const Character& character, std::int64_t now_ns);
  // Takes the commands of the I/O thread from the queue, and runs them in their order until the messages that they
  // cause reach the tick's bound (character_messages_left_). The other commands wait for the next tick.
  void take_commands(std::int64_t now_ns);
  // Runs taken_ from next_command_ on, while the tick may still send messages about characters.
  void run_commands(std::int64_t now_ns);
  // Samples every inbox at the tick's sample time, puts characters with a first pose into the World, and writes the
  // changed poses into inputs_.
  void sample_poses();
  // Samples the pose of one character, and adds its age to `ages`. Writes to this character alone, so workers may run
  // it for many characters at once.
  void sample_pose(Character& character, Histogram::Tally& ages);
  // Finds for each character how many observers see it and how large, and for each observer, at its turn, which members
  // it wants.
  void update_interest();
  void update_interest(const Room& room, Observer& observer);
  // Pass changed materials and winds to the World, and changed tags and appearances to the other sessions.
  void change_materials();
  void change_winds(std::int64_t now_ns);
  void tell_appearances(std::int64_t now_ns);
  // Gives the recorder the file of each groom before the first tick that uses its levels, so that a replay can build
  // them.
  void record_grooms();
  // Steps the World with inputs_, counts what the step reports, and tells owners whose hair states did not fit.
  StepReport step(std::int64_t now_ns);
  // Gives the recorder inputs_ with the hash of the state after the step.
  void record();

  // Removes the character from its room and from the World, and tells the other sessions.
  void remove(CharacterKey key, std::int64_t now_ns);
  // True while the character does not enter the World, because its hair state waits for levels. Counts one tick of
  // waiting.
  [[nodiscard]] bool awaits_levels(Character& character) const;
  // Puts the character into the World, on the rigid level.
  void place(Character& character);
  // A character that gets its first lattice continues from the state that its owner sent, as after a change of server.
  void apply_hair_states();
  // Keeps the state until the character has a lattice. Beyond state_bytes_max the owner gets an error, and the hair
  // starts at rest.
  void store_hair_state(Character& character, wire::HairState state, std::int64_t now_ns);
  // Drops the state of the character, if it has one.
  void forget_hair_state(Character& character);
  void check_invariants() const;
  // Tells the owner of the character that its hair state was not used.
  void refuse_hair_state(CharacterKey key, std::string detail, std::int64_t now_ns);
  // Smooths the speed of the head over about a second, for the budget; still heads hide errors better.
  void note_motion(Character& character, double moved_m, double turned_rad) const;
  // Gives the recorder the file and the learnt hair of the groom, once.
  void record_groom(const wire::GroomHash& groom);
  // Returns the session's view of the character that has the slot now. A view of an earlier character in the slot is
  // replaced by an empty one.
  static View& view_of(Observer& observer, const Room& room, std::size_t slot);

  [[nodiscard]] std::int64_t clock_ns() const { return def_.world.now_ns ? def_.world.now_ns() : 0; }

  // The settings, with the tick rate and the clock copied into all parts.
  SchedulerDef def_;
  CommandQueue* commands_;
  TickCounters* counters_;
  Recorder* recorder_;
  Rooms rooms_;
  Simulation simulation_;
  Touch touch_;
  LevelChooser level_chooser_;
  Publisher publisher_;
  // The commands taken from the queue. Those before next_command_ are done; the others may be left for the next tick.
  std::vector<Command> taken_;
  std::size_t next_command_ = 0;
  // This tick may still send this many messages about characters that come and go. It begins at kCharacterMessagesMax
  // (scheduler_commands.cpp), and one command may take it below zero.
  std::int64_t character_messages_left_ = 0;
  // The sessions that do not know all members of their room yet, in the order of their turns.
  std::deque<SessionId> announcements_;
  // This tick may still announce this many members, to all sessions together. It begins at kAnnouncementsOfAllMax.
  std::size_t announcement_count_left_ = 0;
  // The characters whose new material the World does not know yet.
  std::set<CharacterKey> materials_changed_;
  // The characters whose new tag or appearance other sessions do not know yet.
  std::set<CharacterKey> appearances_changed_;
  // All input of the step of the tick that is being made.
  wire::RecordedTick inputs_;
  // The characters that have a new pose at this tick.
  std::vector<Character*> moved_;
  // The heads of one observer's room, by slot, and which of them it wants. They are buffers of update_interest().
  std::vector<MemberHead> heads_;
  std::vector<bool> wanted_;
  // The bytes of all hair states that wait for their levels; state_bytes_max bounds them.
  std::size_t state_bytes_ = 0;
  // The files and the learnt hair of grooms that the recording does not contain yet.
  std::map<wire::GroomHash, Recorder::Bytes> unrecorded_;
  std::map<wire::GroomHash, std::shared_ptr<const LearntHair>> unrecorded_learnt_;
};

}  // namespace hairnet::server
