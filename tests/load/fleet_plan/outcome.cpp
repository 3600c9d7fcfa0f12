#include "tests/load/fleet_plan/outcome.hpp"

#include <algorithm>
#include <numeric>

namespace hairnet::fleet_plan {
namespace {

constexpr double kMonthDays = 30;

template <class Count>
double number(Count count) {
  return static_cast<double>(count);
}

}  // namespace

std::uint64_t EtcdCounts::total() const {
  return std::accumulate(writes.begin(), writes.end(), std::uint64_t{0});
}

void EtcdCounts::add(const EtcdCounts& other) {
  for (std::size_t i = 0; i < kEtcdWriteCount; ++i) writes[i] += other.writes[i];
  watch_events += other.watch_events;
}

std::vector<FigureGroup> figures(const Outcome& o) {
  // The bound of 1 keeps an empty outcome from dividing by zero.
  const double seconds = std::max(1.0, o.seconds), days = seconds / 86'400;
  const double askers = std::max(1.0, number(o.arrived));
  std::vector<FigureGroup> groups;
  groups.push_back({"People",
                    {{"people_mean", "at once, mean", "", o.people_sum_s / seconds},
                     {"people_max", "at once, most", "", o.people_max},
                     {"arrivals_per_s", "arrivals a second, mean", "", number(o.arrived) / seconds},
                     {"join_p50_s", "from arrival to hair, p50", "s", o.join.quantile_ms(0.5) / 1e3},
                     {"join_p99_s", "the same, p99", "s", o.join.quantile_ms(0.99) / 1e3},
                     {"refused_by_caps_per_day", "refused by a full room, a day", "", number(o.refused_by_caps) / days},
                     {"turned_away_rooms_full_share", "of arrivals that found no room below its cap", "%",
                      100 * number(o.turned_away_rooms_full) / askers},
                     {"turned_away_no_server_share", "of arrivals that waited for a server in vain", "%",
                      100 * number(o.turned_away_no_server) / askers},
                     {"coarse_share", "of people's time on servers above their budget: coarser hair", "%",
                      o.people_sum_s > 0 ? 100 * o.coarse_people_sum_s / o.people_sum_s : 0}}});
  groups.push_back({"Servers",
                    {{"servers_needed_mean", "needed without a buffer, mean", "", o.servers_needed_sum_s / seconds},
                     {"servers_needed_max", "the same, most", "", o.servers_needed_max},
                     {"servers_mean", "paid for, mean", "", o.server_seconds / seconds},
                     {"servers_max", "the same, most", "", o.servers_max},
                     // The histogram has ratios as if they were milliseconds (Simulation::account).
                     {"balance_p50", "largest over mean load of servers, p50", "", o.balance.quantile_ms(0.5)},
                     {"balance_p99", "the same, p99", "", o.balance.quantile_ms(0.99)},
                     {"server_memory_max", "memory of a server, most", "GB", o.server_bytes_max / 1e9},
                     {"failures_per_day", "killed, a day", "", number(o.failures) / days}}});
  FigureGroup moves{"Moves of rooms", {}};
  for (std::size_t i = 0; i < kMoveCauseCount; ++i) {
    std::string cause(kMoveCauseNames[i]), key = cause;
    std::ranges::replace(key, '-', '_');
    moves.figures.push_back({key + "_rooms_per_day", cause + ": rooms a day", "", number(o.rooms_moved[i]) / days});
    moves.figures.push_back({key + "_people_per_day", cause + ": people a day", "", number(o.people_moved[i]) / days});
    moves.figures.push_back(
        {key + "_room_outage_p50_s", cause + ": a room's outage, p50", "s", o.room_outage[i].quantile_ms(0.5) / 1e3});
    moves.figures.push_back(
        {key + "_room_outage_p99_s", cause + ": the same, p99", "s", o.room_outage[i].quantile_ms(0.99) / 1e3});
    moves.figures.push_back({key + "_hair_away_p99_s", cause + ": until a person's hair moves again, p99", "s",
                             o.hair_away[i].quantile_ms(0.99) / 1e3});
  }
  groups.push_back(std::move(moves));
  groups.push_back({"Rooms",
                    {{"room_people_max", "people of the largest", "", o.room_people_max},
                     {"room_cores_max", "cores that it takes", "", o.room_cpu_s_max},
                     {"room_gbit_per_s_max", "bits that it sends", "Gbit/s", o.room_bytes_per_s_max * 8 / 1e9},
                     {"rooms_overloaded", "rooms that overloaded a server", "", number(o.rooms_overloaded)},
                     {"rooms_overloaded_max", "the same, at once", "", o.rooms_overloaded_max}}});
  FigureGroup etcd{"etcd, a second", {}};
  for (std::size_t i = 0; i < kEtcdWriteCount; ++i) {
    std::string name(kEtcdWriteNames[i]), key = name;
    std::ranges::replace(key, '-', '_');
    etcd.figures.push_back({"etcd_" + key + "_per_s", name + ", mean", "", number(o.etcd.writes[i]) / seconds});
    etcd.figures.push_back({"etcd_" + key + "_max_per_s", name + ", most", "", number(o.etcd_max.writes[i])});
  }
  etcd.figures.push_back({"etcd_requests_per_s", "all, mean", "", number(o.etcd.total()) / seconds});
  etcd.figures.push_back({"etcd_requests_max_per_s", "all, most", "", number(o.etcd_writes_max)});
  etcd.figures.push_back(
      {"watch_messages_per_s", "messages to servers' watches, mean", "", number(o.etcd.watch_events) / seconds});
  etcd.figures.push_back({"watch_messages_max_per_s", "the same, most", "", number(o.etcd_max.watch_events)});
  groups.push_back(std::move(etcd));
  groups.push_back({"Network",
                    {{"egress_gbit_per_s", "from all servers, mean", "Gbit/s", o.egress_bytes / seconds * 8 / 1e9},
                     {"egress_max_gbit_per_s", "the same, most", "Gbit/s", o.egress_bytes_per_s_max * 8 / 1e9},
                     {"egress_tb_per_month", "in 30 days", "TB", o.egress_bytes / days * kMonthDays / 1e12}}});
  return groups;
}

}  // namespace hairnet::fleet_plan
