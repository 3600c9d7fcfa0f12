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

struct Person {
  RoomId room = kNone;
  // Indexes its room's members.
  std::uint32_t place = 0;
  std::uint32_t hairstyle = 0;
  // Counts the rooms asked for.
  std::uint32_t tries = 0;
  // Is when it arrived.
  std::int64_t since_s = 0;
  // Is false while it waits.
  bool is_member = false;
};

struct Room {
  enum class State : std::uint8_t {
    unowned,
    // Its owner serves it.
    owned,
    // Its people wait for a server.
    away,
  };
  State state = State::unowned;
  // Is the server whose key etcd has; of a room that is away, a server that was killed.
  ServerSlot owner = kNone;
  // Indexes its owner's rooms.
  std::uint32_t place = 0;
  std::vector<PersonId> members, waiting;
  // Is when its owner got it.
  std::int64_t since_s = 0;
  // Add up what the members take.
  double cpu_s = 0, bytes_per_s = 0;
  // Is when it next tries to find a server, in `away`.
  std::int64_t try_at_s = 0;
  // Is when frames stopped for members; below zero nobody had frames.
  double away_since_s = -1;
  MoveCause cause = MoveCause::deploy;
  std::int64_t empty_since_s = -1;
  // Is true when it was ever more than one server's budget.
  bool has_been_overloaded = false;
  // Is true while it is listed as away, or with people who wait.
  bool is_pending = false;
};

struct Server {
  enum class State : std::uint8_t { starting, ready, dead, ended };
  State state = State::starting;
  std::uint64_t id = 0;
  // Is true until the rolling update replaces it.
  bool is_old = false;
  std::int64_t ready_at_s = 0, lease_ends_s = 0;
  double fails_at_s = 0, keep_alive_at_s = 0;
  // Is when the thread that reads levels is free.
  double loader_free_at_s = 0;
  // Is when a hairstyle's levels are in memory; infinite when it is not asked for.
  std::vector<double> hairstyle_at_s;
  // Counts those in memory.
  std::uint32_t hairstyles = 0;
  std::vector<RoomId> rooms;
  std::uint32_t people = 0;
  // Adds up what its rooms take in a second.
  double cpu_s = 0;
  server::Balance balance;
};

// A fleet in simulated time, in steps of a second. Placement is the servers' own (server/fleet/placement); etcd, the
// network and the servers are counts and times. One thread; the same settings give the same outcome.
class Simulation {
 public:
  explicit Simulation(const Settings& settings);

  void step();  // one second
  [[nodiscard]] bool is_done() const { return now_s_ >= end_s_; }
  [[nodiscard]] std::int64_t now_s() const { return now_s_; }
  [[nodiscard]] const Outcome& outcome() const { return outcome_; }

  [[nodiscard]] std::size_t people() const { return member_count_ + waiting_count_; }
  [[nodiscard]] std::size_t waiting() const { return waiting_count_; }
  [[nodiscard]] const std::vector<Room>& rooms() const { return rooms_; }
  [[nodiscard]] const std::vector<Server>& servers() const { return servers_; }
  // Empty when the state agrees with itself: each room is in its owner's list alone, members and loads add up, nobody
  // is lost. Else one line. For tests; walks everything.
  [[nodiscard]] std::string fault() const;
  // For tests: kill -9, and a drain as at SIGTERM.
  void kill(ServerSlot slot);
  void drain(ServerSlot slot, MoveCause cause);

 private:
  // People.
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

  // Rooms.
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
  std::vector<std::vector<PersonId>> departures_;  // by second
  double until_arrival_ = 0;                       // in mean numbers of arrivals

  std::vector<Room> rooms_;
  std::vector<std::string> room_names_;
  std::vector<RoomId> pending_;
  // Holds when rooms became empty, in order.
  std::deque<std::pair<std::int64_t, RoomId>> empty_;
  std::size_t overloaded_now_ = 0;

  std::vector<Server> servers_;
  // Holds all but those that have ended.
  std::vector<ServerSlot> active_;
  // Are as etcd has them.
  std::vector<server::ServerStatus> statuses_;
  // Holds the servers of `statuses_`.
  std::vector<ServerSlot> status_slots_;
  std::int64_t too_many_since_s_ = -1;
  bool is_deploying_ = false;

  // Add up all rooms that are served.
  double cpu_s_ = 0, bytes_per_s_ = 0;
  // Is etcd's work in this second.
  EtcdCounts second_;
  // Adds up what came since the last sample.
  Sample interval_;
  std::int64_t interval_seconds_ = 0;
};

// Runs to the end.
Outcome simulate(const Settings& settings);

}  // namespace hairnet::fleet_plan
