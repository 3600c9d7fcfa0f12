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
  // Are the mean, and the standard deviation of its logarithm.
  double session_min = 30, session_sigma = 1;
  // A person waits so long for a place.
  double patience_s = 60;

  // Rooms: the one of rank k is chosen with a probability in proportion to k^-zipf.
  std::uint32_t rooms = 20'000;
  double zipf = 0.9;
  // Limits the people of a room; zero allows any number.
  std::uint32_t room_cap = 256;
  // Limits the rooms that a person asks for, while they are full, before it goes away.
  std::uint32_t room_tries = 3;
  // Limits the members whose hair a client gets.
  std::uint32_t observe = 32;
  // People wear them, all equally often.
  std::uint32_t hairstyles = 100;

  HairLevel level = HairLevel::low;

  // Servers.
  // Work may take budget_share of the cores' time.
  double cores = 4, budget_share = 0.7;
  // Detail can be lowered no further at so many times the budget.
  double overload_max = 4;
  // Limits the characters of a server.
  std::uint32_t characters_max = 4096;
  double lease_s = 9;
  // Servers that are short of time give up rooms.
  bool balance = true;
  // Is the mean time of a server between kills; zero means none.
  double mtbf_h = 720;
  // Lies between one rolling update and the next, the first after half of it; zero means none.
  double deploy_h = 24;
  // Is the share of servers that are replaced at a time.
  double deploy_share = 0.1;

  // Autoscaling.
  // Is a fixed number; zero means autoscaling.
  std::uint32_t servers = 0;
  // Autoscaling keeps at least so many.
  std::uint32_t servers_min = 2;
  // Is added to the needed servers, as a share of them.
  double buffer = 0.25;
  // A server takes so long to start, with its machine.
  double start_s = 90;
  // Servers must be too many for so long before some are stopped.
  double scale_in_s = 600;

  ServerCosts costs;

  // Worker-seconds a second that a server's characters may take at their level.
  [[nodiscard]] double capacity() const { return cores * budget_share; }
};

// Empty when the settings agree with each other; else one line.
std::string validate(const Settings& settings);

}  // namespace hairnet::fleet_plan
