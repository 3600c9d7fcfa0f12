#include "tests/load/fleet_plan/server_costs.hpp"

#include <algorithm>

namespace hairnet::fleet_plan {
namespace {

// The figures of ServerCosts were measured in rooms of so many people, who all see each other.
constexpr double kSmallRoom = 8, kLargeRoom = 32, kLearntRoom = 4;

// The straight line through the values in the small and in the large room, at a room of `observed` people.

double line_through(double small, double large, double observed) {
  return std::max(0.0, small + (large - small) / (kLargeRoom - kSmallRoom) * (observed - kSmallRoom));
}

}  // namespace

// Learnt hair was measured only in a crowd that one client observes. There its step takes less time than the low
// level's; the same difference is subtracted from the low level's time in rooms.
double ServerCosts::cpu_s(HairLevel level, double observed) const {
  const double low_ms = line_through(low_cpu_8_ms, low_cpu_32_ms, observed);
  switch (level) {
    case HairLevel::low:
      return low_ms / 1e3;
    case HairLevel::half_learnt:
      return (cpu_s(HairLevel::low, observed) + cpu_s(HairLevel::learnt, observed)) / 2;
    case HairLevel::learnt:
      return std::max(crowd_learnt_cpu_ms, low_ms - crowd_low_cpu_ms + crowd_learnt_cpu_ms) / 1e3;
    case HairLevel::high:
      break;
  }
  return line_through(high_cpu_8_ms, high_cpu_32_ms, observed) / 1e3;
}

double ServerCosts::bytes_per_s(HairLevel level, double observed) const {
  const double low_kb = line_through(low_8_kb, low_32_kb, observed), learnt_kb = learnt_4_kb / kLearntRoom * observed;
  switch (level) {
    case HairLevel::low:
      return low_kb * 1e3;
    case HairLevel::half_learnt:
      return (low_kb + learnt_kb) / 2 * 1e3;
    case HairLevel::learnt:
      return learnt_kb * 1e3;
    case HairLevel::high:
      break;
  }
  return line_through(high_8_kb, high_32_kb, observed) * 1e3;
}

const std::vector<CostFigure>& cost_figures() {
  constexpr std::string_view kRooms8 = "tests/load/README.md, rooms of 8 over TCP",
                             kRooms32 = "tests/load/README.md, rooms of 32", kCrowd = "tests/load/README.md, a crowd",
                             kSizing = "deploy/README.md, Sizing", kAssumed = "assumed";
  static const std::vector<CostFigure> figures{
      {"--low-cpu-8", &ServerCosts::low_cpu_8_ms, "ms", "processor time, low, a character and second in a room of 8",
       kRooms8},
      {"--low-cpu-32", &ServerCosts::low_cpu_32_ms, "ms", "the same in a room of 32", kRooms32},
      {"--high-cpu-8", &ServerCosts::high_cpu_8_ms, "ms", "the same, high, in a room of 8", kRooms8},
      {"--high-cpu-32", &ServerCosts::high_cpu_32_ms, "ms", "the same, high, in a room of 32", kRooms32},
      {"--crowd-low-cpu", &ServerCosts::crowd_low_cpu_ms, "ms",
       "processor time, low, in a crowd that one client observes", kCrowd},
      {"--crowd-learnt-cpu", &ServerCosts::crowd_learnt_cpu_ms, "ms", "the same, learnt", kCrowd},
      {"--low-kb-8", &ServerCosts::low_8_kb, "kB", "bytes from the server, low, a character and second in a room of 8",
       kRooms8},
      {"--low-kb-32", &ServerCosts::low_32_kb, "kB", "the same in a room of 32", kRooms32},
      {"--high-kb-8", &ServerCosts::high_8_kb, "kB", "the same, high, in a room of 8", kRooms8},
      {"--high-kb-32", &ServerCosts::high_32_kb, "kB", "the same, high, in a room of 32", kRooms32},
      {"--learnt-kb-4", &ServerCosts::learnt_4_kb, "kB", "the same, learnt, in a room of 4; clients evaluate it",
       "tests/load/README.md, a room of 4"},
      {"--process-mb", &ServerCosts::process_mb, "MB", "memory of a server without clients", kSizing},
      {"--hairstyle-mb", &ServerCosts::hairstyle_mb, "MB", "memory of a hairstyle's levels", kSizing},
      {"--session-kb", &ServerCosts::session_kb, "kB", "memory of a session with its character", kAssumed, false},
      {"--claim-ms", &ServerCosts::claim_ms, "ms", "a claim at etcd",
       "deploy/README.md: a drained room takes 30 ms, split here"},
      {"--redirect-ms", &ServerCosts::redirect_ms, "ms", "a redirect, without the network", "the same"},
      {"--round-trip-ms", &ServerCosts::round_trip_ms, "ms", "between client and server", kAssumed, false},
      {"--connect-round-trips", &ServerCosts::connect_round_trips, "", "of TCP, TLS and Hello", kAssumed, false},
      {"--level-load-s", &ServerCosts::level_load_s, "s",
       "to load a hairstyle's levels from the shared cache, one at a time", kAssumed, false},
  };
  return figures;
}

}  // namespace hairnet::fleet_plan
