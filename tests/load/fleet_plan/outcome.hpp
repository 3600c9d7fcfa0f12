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

// What a server asks of etcd. A keep-alive changes no key.
enum class EtcdWrite : std::uint8_t { keep_alive, status, claim, release, lease };
inline constexpr std::size_t kEtcdWriteCount = 5;
inline constexpr std::array<std::string_view, kEtcdWriteCount> kEtcdWriteNames{"keep-alives", "statuses", "claims",
                                                                               "releases", "leases"};

struct EtcdCounts {
  std::array<std::uint64_t, kEtcdWriteCount> writes{};
  std::uint64_t watch_events = 0;  // changes of keys, times the servers that watch

  [[nodiscard]] std::uint64_t of(EtcdWrite kind) const { return writes[static_cast<std::size_t>(kind)]; }
  [[nodiscard]] std::uint64_t total() const;
  void add(const EtcdCounts& other);
};

// Means of an interval.
struct Sample {
  double hour = 0;
  double people = 0, waiting = 0;
  double servers_needed = 0, servers_running = 0;
  // Are shares of the budget: mean and largest over the servers.
  double used_share = 0, used_share_max = 0;
  double egress_bytes_per_s = 0;
  // Holds sums.
  EtcdCounts etcd;
  std::array<std::uint64_t, kMoveCauseCount> rooms_moved{};
  double seconds = 0;
};

// What has happened so far.
struct Outcome {
  double seconds = 0;
  // People. Those at the start came before it. arrived = left + turned away + still there.
  std::uint64_t at_start = 0, arrived = 0, left = 0, turned_away_rooms_full = 0, turned_away_no_server = 0;
  // Counts answers: a person may ask for several rooms.
  std::uint64_t refused_by_caps = 0;
  double people_sum_s = 0, people_max = 0;
  // Sums people by the second, on servers that had to lower detail.
  double coarse_people_sum_s = 0;
  // Lasts between a person's arrival and its hair.
  load::LatencyHistogram join;
  // Rooms.
  std::array<std::uint64_t, kMoveCauseCount> rooms_moved{}, people_moved{};
  // Lasts between the last frame and the next server's claim.
  std::array<load::LatencyHistogram, kMoveCauseCount> room_outage;
  // Lasts likewise for a person, until its levels are loaded there.
  std::array<load::LatencyHistogram, kMoveCauseCount> hair_away;
  // Counts rooms that ever were more than one server's budget.
  std::uint64_t rooms_overloaded = 0;
  // Counts the most of them at a time.
  double rooms_overloaded_max = 0;
  double room_people_max = 0, room_cpu_s_max = 0, room_bytes_per_s_max = 0;
  // Servers.
  double server_seconds = 0, servers_max = 0, servers_needed_max = 0, servers_needed_sum_s = 0;
  std::uint64_t failures = 0, deploys = 0, servers_started = 0, servers_stopped = 0;
  load::LatencyHistogram balance;  // largest over mean used budget, a "millisecond" for 1, by the second
  double server_bytes_max = 0;     // memory
  // etcd and network.
  EtcdCounts etcd, etcd_max;  // etcd_max: each the most in a second
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
