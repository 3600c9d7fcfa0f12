#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tests/load/latency_histogram.hpp"

namespace hairnet::fleet_plan {

// Why a room goes to another server.
enum class MoveCause : std::uint8_t { deploy, failure, scale_in, balance };
inline constexpr std::size_t kMoveCauseCount = 4;
inline constexpr std::array<std::string_view, kMoveCauseCount> kMoveCauseNames{"deploy", "failure", "scale-in",
                                                                               "balance"};

// What a server asks of etcd. A keep-alive and the grant or revocation of a lease change no key themselves; every
// server's watch hears of the other three.
enum class EtcdWrite : std::uint8_t { keep_alive, status, claim, release, lease };
inline constexpr std::size_t kEtcdWriteCount = 5;
inline constexpr std::array<std::string_view, kEtcdWriteCount> kEtcdWriteNames{"keep-alives", "statuses", "claims",
                                                                               "releases", "leases"};

struct EtcdCounts {
  std::array<std::uint64_t, kEtcdWriteCount> writes{};
  // Each change of a key counts once for each server that watches.
  std::uint64_t watch_events = 0;

  [[nodiscard]] std::uint64_t of(EtcdWrite kind) const { return writes[static_cast<std::size_t>(kind)]; }
  [[nodiscard]] std::uint64_t total() const;
  void add(const EtcdCounts& other);
};

// The means over an interval of the run, one point of the page's plots.
struct Sample {
  // The middle of the interval, in hours since the start.
  double hour = 0;
  double people = 0, waiting = 0;
  // The servers that the load needs without a buffer, and those that are ready.
  double servers_needed = 0, servers_running = 0;
  // The used share of a server's budget (Settings::capacity): the mean over servers and time, and the largest of any
  // server in any second.
  double used_share = 0, used_share_max = 0;
  double egress_bytes_per_s = 0;
  // `etcd` and `rooms_moved` are sums over the interval, which lasts `seconds`.
  EtcdCounts etcd;
  std::array<std::uint64_t, kMoveCauseCount> rooms_moved{};
  double seconds = 0;
};

// What has happened so far.
struct Outcome {
  double seconds = 0;
  // People. `at_start` were there when the run began. at_start + arrived = left + turned away + still there.
  std::uint64_t at_start = 0, arrived = 0, left = 0, turned_away_rooms_full = 0, turned_away_no_server = 0;
  // The number of refusals by full rooms. A person may get several of them (Settings::room_tries).
  std::uint64_t refused_by_caps = 0;
  // The sum over all seconds of the people who were there, and the largest number of people.
  double people_sum_s = 0, people_max = 0;
  // The same sum of the people on servers above their budget, which must lower the detail of hair.
  double coarse_people_sum_s = 0;
  // The time from a person's arrival until the server can simulate the person's hair.
  load::LatencyHistogram join;
  // Rooms. The arrays are indexed by MoveCause.
  std::array<std::uint64_t, kMoveCauseCount> rooms_moved{}, people_moved{};
  // The time from a room's last frame until its next server has claimed it and the clients are sent there.
  std::array<load::LatencyHistogram, kMoveCauseCount> room_outage;
  // The same time for each person, until the client has connected and the levels are loaded at the new server.
  std::array<load::LatencyHistogram, kMoveCauseCount> hair_away;
  // The number of rooms that have ever taken more than the budget of one server.
  std::uint64_t rooms_overloaded = 0;
  // The largest number of rooms above a server's budget at the same time.
  double rooms_overloaded_max = 0;
  // The largest values that any one room has had.
  double room_people_max = 0, room_cpu_s_max = 0, room_bytes_per_s_max = 0;
  // Servers. `server_seconds` is what is paid for: it includes servers that start or are dead.
  double server_seconds = 0, servers_max = 0, servers_needed_max = 0, servers_needed_sum_s = 0;
  std::uint64_t failures = 0, deploys = 0, servers_started = 0, servers_stopped = 0;
  // The largest load of a server over the mean load, one entry for each second. A ratio of 1 is one millisecond.
  load::LatencyHistogram balance;
  // The largest memory of a server.
  double server_bytes_max = 0;
  // etcd and network. Each count of `etcd_max` is the largest in one second, and so is `etcd_writes_max`, of all kinds
  // together.
  EtcdCounts etcd, etcd_max;
  std::uint64_t etcd_writes_max = 0;
  double egress_bytes = 0, egress_bytes_per_s_max = 0;
  std::vector<Sample> samples;
};

// A figure of an outcome, for tables and files.
struct Figure {
  std::string name, meaning, unit;
  double value = 0;
};
struct FigureGroup {
  std::string title;
  std::vector<Figure> figures;
};
std::vector<FigureGroup> figures(const Outcome& outcome);

}  // namespace hairnet::fleet_plan
