#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "core/random.hpp"
#include "server/fleet/balance.hpp"
#include "server/fleet/server_status.hpp"
#include "tests/load/fleet_plan/demand.hpp"
#include "tests/load/fleet_plan/outcome.hpp"
#include "tests/load/fleet_plan/settings.hpp"

namespace hairnet::fleet_plan {

using PersonId = std::uint32_t;
using RoomId = std::uint32_t;
using ServerSlot = std::uint32_t;
// A server's id has the slot in these bits; the others are random.
inline constexpr unsigned kSlotBits = 20;
inline constexpr std::uint64_t kSlotMask = (1u << kSlotBits) - 1;
inline constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

// One user. A person arrives, asks for rooms, waits for a place in one, and is then a member until the session ends.
struct Person {
  RoomId room = kNone;
  // The person is `members[place]` of the room.
  std::uint32_t place = 0;
  // The hairstyle is below Settings::hairstyles. A server must load its levels before it can simulate the person.
  std::uint32_t hairstyle = 0;
  // The number of full rooms that have refused the person; Settings::room_tries is the limit.
  std::uint32_t tries = 0;
  // The second of the arrival; it is negative for people who came before the start of the simulation.
  std::int64_t since_s = 0;
  // It is false while the person is in the room's `waiting`.
  bool is_member = false;
};

struct Room {
  enum class State : std::uint8_t {
    // Nobody is in the room, and etcd has no key of it.
    unowned,
    // The owner sends frames to the members.
    owned,
    // The room has people but no server sends frames: it was given up, its server was killed, or no server takes it.
    away,
  };
  State state = State::unowned;
  // The server that etcd names as the owner. A killed server stays the owner of a room that is away until its lease
  // has ended.
  ServerSlot owner = kNone;
  // The room is `rooms[place]` of its owner.
  std::uint32_t place = 0;
  // Members have a place in the room; waiting people want one, in the order of their arrival.
  std::vector<PersonId> members, waiting;
  // The second in which the present owner claimed the room.
  std::int64_t since_s = 0;
  // The processor time in seconds, and the bytes sent, that all members take in a second.
  double cpu_s = 0, bytes_per_s = 0;
  // A room that is away looks for a server no earlier than in this second.
  std::int64_t try_at_s = 0;
  // The second in which the members lost their frames; it is negative when no member has lost any.
  double away_since_s = -1;
  // The reason of the room's last move.
  MoveCause cause = MoveCause::deploy;
  // The second in which the room last became empty; it is negative once somebody has come again.
  std::int64_t empty_since_s = -1;
  // It stays true once the room has taken more than Settings::capacity(), so that Outcome counts the room once.
  bool has_been_overloaded = false;
  // It is true while the room is in Simulation::pending_.
  bool is_pending = false;
};

struct Server {
  // A dead server was killed, and etcd still has its keys until its lease has ended. An ended server has no keys.
  enum class State : std::uint8_t { starting, ready, dead, ended };
  State state = State::starting;
  // The lower kSlotBits bits are the server's slot.
  std::uint64_t id = 0;
  // A rolling update marks all servers as old when it begins, and replaces each of them.
  bool is_old = false;
  // `lease_ends_s` counts for dead servers alone.
  std::int64_t ready_at_s = 0, lease_ends_s = 0;
  // The time of the random kill, and the time of the next keep-alive of the lease.
  double fails_at_s = 0, keep_alive_at_s = 0;
  // One thread loads levels, one hairstyle after another. It is free from this time on.
  double loader_free_at_s = 0;
  // The time at which the levels of each hairstyle are in memory. It is infinite while nobody has asked for them.
  std::vector<double> hairstyle_at_s;
  // The number of hairstyles that are in memory or being loaded.
  std::uint32_t hairstyles = 0;
  std::vector<RoomId> rooms;
  // The number of members of all its rooms.
  std::uint32_t people = 0;
  // The processor time in seconds that its rooms take in a second.
  double cpu_s = 0;
  server::Balance balance;
};

// A fleet in simulated time, in steps of a second. Placement is the servers' own (server/fleet/placement); etcd, the
// network and the servers are counts and times. One thread; the same settings give the same outcome.
class Simulation {
 public:
  explicit Simulation(const Settings& settings);

  // Simulates one second.
  void step();
  [[nodiscard]] bool is_done() const { return now_s_ >= end_s_; }
  [[nodiscard]] std::int64_t now_s() const { return now_s_; }
  [[nodiscard]] const Outcome& outcome() const { return outcome_; }

  [[nodiscard]] std::size_t people() const { return member_count_ + waiting_count_; }
  [[nodiscard]] std::size_t waiting() const { return waiting_count_; }
  [[nodiscard]] const std::vector<Room>& rooms() const { return rooms_; }
  [[nodiscard]] const std::vector<Server>& servers() const { return servers_; }
  // Tests call this after each step. It looks at every room and server, and returns one line about a contradiction:
  // a room in two lists, members or loads that do not add up, a person who is lost. It is empty when all is consistent.
  [[nodiscard]] std::string fault() const;
  // Ends the server as `kill -9` does, so that its rooms wait for the end of its lease.
  void kill(ServerSlot slot);
  // Ends the server as SIGTERM does: it gives its rooms up at once. `cause` is what the statistics name as the reason.
  void drain(ServerSlot slot, MoveCause cause);

 private:
  // People. `fill` makes those who are there at the start, `admit` makes a person a member of a room that has an owner.
  void fill();
  void take_arrivals();
  void take_departures();
  PersonId add_person(std::int64_t since_s);
  void remove_person(PersonId id) { free_people_.push_back(id); }
  void seek_room(PersonId id);
  void wait_for(RoomId room, PersonId id);
  void admit(RoomId room, PersonId id, double delay_s);
  void leave(PersonId id);
  double level_wait_s(Server& server, std::uint32_t hairstyle);
  [[nodiscard]] double connect_s(std::size_t ready_servers);

  // Rooms. `own` and `disown` set and remove the owner's key in etcd; `stop_serving` ends the frames and keeps the key.
  bool place(RoomId room);
  void own(RoomId room, ServerSlot slot);
  void disown(RoomId room);
  void move_room(RoomId room, ServerSlot to);
  void stop_serving(RoomId room, MoveCause cause, std::int64_t try_at_s);
  void update_load(RoomId room);
  void set_pending(RoomId room);
  void take_pending();
  void release_empty();
  [[nodiscard]] bool is_full(const Server& server) const;

  // Servers.
  ServerSlot start_server(std::int64_t ready_at_s);
  void make_ready(ServerSlot slot);
  void take_starts_and_ends();
  void end(ServerSlot slot);
  void scale();
  void deploy();
  void balance();
  [[nodiscard]] bool is_big(const Room& room) const;
  [[nodiscard]] std::size_t count(Server::State state) const;
  [[nodiscard]] std::size_t target() const;

  // etcd.
  [[nodiscard]] server::ServerLoad load_of(const Server& server) const;
  void write(EtcdWrite kind, std::size_t writes = 1);
  void tell_statuses();
  void keep_alive();

  void account();

  Settings settings_;
  Demand demand_;
  Random random_;
  std::int64_t now_s_ = 0, end_s_ = 0;
  Outcome outcome_;

  std::vector<Person> people_;
  std::vector<PersonId> free_people_;
  std::size_t member_count_ = 0, waiting_count_ = 0;
  // The people who leave in each second of the run.
  std::vector<std::vector<PersonId>> departures_;
  // Arrivals are a Poisson process. The next person comes once the arrival rates of the coming seconds add up to this.
  double until_arrival_ = 0;

  std::vector<Room> rooms_;
  std::vector<std::string> room_names_;
  // The rooms that are away, or that people wait for.
  std::vector<RoomId> pending_;
  // The second in which each room became empty, the earliest first. A room that fills again stays in this list.
  std::deque<std::pair<std::int64_t, RoomId>> empty_;
  // The number of rooms that take more than Settings::capacity() in this second.
  std::size_t overloaded_now_ = 0;

  std::vector<Server> servers_;
  // The slots of all servers that have not ended.
  std::vector<ServerSlot> active_;
  // The entries of the servers in etcd, which every server knows at once.
  std::vector<server::ServerStatus> statuses_;
  // `statuses_[i]` is the entry of the server in slot `status_slots_[i]`.
  std::vector<ServerSlot> status_slots_;
  // The second since which there are more servers than target(); it is negative while there are not.
  std::int64_t too_many_since_s_ = -1;
  // It is true from the beginning of a rolling update until no old server is left.
  bool is_deploying_ = false;

  // The processor time in seconds, and the bytes, that all owned rooms take in a second.
  double cpu_s_ = 0, bytes_per_s_ = 0;
  // The requests that etcd has had in the present second.
  EtcdCounts second_;
  // The sums since the last sample of Outcome::samples; account() divides them by the seconds.
  Sample interval_;
  // A sample covers so many seconds.
  std::int64_t interval_seconds_ = 0;
};

// Runs to the end.
Outcome simulate(const Settings& settings);

}  // namespace hairnet::fleet_plan
