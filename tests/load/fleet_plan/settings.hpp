#pragma once

#include <cstdint>
#include <string>

#include "tests/load/fleet_plan/server_costs.hpp"

namespace hairnet::fleet_plan {

// The fleet, the people who come to it, and what happens to it.
struct Settings {
  std::uint64_t seed = 1;
  double days = 2;

  // People: a daily curve of how many are there at once, and how long each stays (log-normal).
  double peak = 100'000, night_share = 0.25, peak_hour = 20;
  // The mean length of a session in minutes, and the standard deviation of the length's logarithm.
  double session_min = 30, session_sigma = 1;
  // A person waits so long for a place in the chosen room, and then goes away.
  double patience_s = 60;

  // Rooms: the one of rank k is chosen with a probability in proportion to k^-zipf.
  std::uint32_t rooms = 20'000;
  double zipf = 0.9;
  // The most people of a room; zero allows any number.
  std::uint32_t room_cap = 256;
  // A person who finds this many rooms full goes away.
  std::uint32_t room_tries = 3;
  // A client gets the hair of at most so many members of its room.
  std::uint32_t observe = 32;
  // The number of different hairstyles. Each person has one of them, all with the same probability.
  std::uint32_t hairstyles = 100;

  HairLevel level = HairLevel::low;

  // Servers.
  // The steps of characters may take budget_share of the time of a server's cores; that is the server's budget.
  double cores = 4, budget_share = 0.7;
  // A server above its budget lowers detail. At so many times the budget detail cannot be lowered further, and the
  // server takes nobody more.
  double overload_max = 4;
  // The most characters of a server.
  std::uint32_t characters_max = 4096;
  double lease_s = 9;
  // Servers above their budget give rooms to others (server/fleet/README.md, Balancing).
  bool balance = true;
  // The mean time until a server is killed; zero means never. The default is 30 days.
  double mtbf_h = 720;
  // The time from one rolling update to the next; the first one comes after half of it. Zero means no updates.
  double deploy_h = 24;
  // A rolling update replaces this share of the servers at a time.
  double deploy_share = 0.1;

  // Autoscaling.
  // The fleet has this fixed number of servers; zero means autoscaling.
  std::uint32_t servers = 0;
  // Autoscaling keeps at least so many.
  std::uint32_t servers_min = 2;
  // Autoscaling keeps more servers than the load needs, by this share.
  double buffer = 0.25;
  // A server takes so long to start, with its machine.
  double start_s = 90;
  // Autoscaling stops servers only after there have been too many of them for so long.
  double scale_in_s = 600;

  ServerCosts costs;

  // The processor time in seconds that a server's characters may take in a second before it must lower detail: the
  // server's budget.
  [[nodiscard]] double capacity() const { return cores * budget_share; }
};

// Empty when the settings agree with each other; else one line.
std::string validate(const Settings& settings);

}  // namespace hairnet::fleet_plan
