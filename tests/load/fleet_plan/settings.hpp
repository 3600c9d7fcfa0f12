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
  double session_min = 30, session_sigma = 1;  // mean; standard deviation of its logarithm
  double patience_s = 60;                      // for which a person waits for a place

  // Rooms: the one of rank k is chosen with a probability in proportion to k^-zipf.
  std::uint32_t rooms = 20'000;
  double zipf = 0.9;
  std::uint32_t room_cap = 256;    // people of a room; 0: any number
  std::uint32_t room_tries = 3;    // rooms that a person asks for, while they are full, before it goes away
  std::uint32_t observe = 32;      // members whose hair a client gets at most
  std::uint32_t hairstyles = 100;  // that people wear, all equally often

  HairLevel level = HairLevel::low;

  // Servers.
  double cores = 4, budget_share = 0.7;  // of the cores' time that work may take
  double overload_max = 4;               // times the budget, at which detail can be lowered no further
  std::uint32_t characters_max = 4096;   // of a server
  double lease_s = 9;
  bool balance = true;        // servers that are short of time give up rooms
  double mtbf_h = 720;        // mean time of a server between kills; 0: none
  double deploy_h = 24;       // from one rolling update to the next, the first after half of it; 0: none
  double deploy_share = 0.1;  // of the servers that are replaced at a time

  // Autoscaling.
  std::uint32_t servers = 0;      // a fixed number; 0: autoscaling
  std::uint32_t servers_min = 2;  // with autoscaling
  double buffer = 0.25;           // of the needed servers that are added to them
  double start_s = 90;            // of a server, with its machine
  double scale_in_s = 600;        // for which servers are too many before some are stopped

  ServerCosts costs;

  // Worker-seconds a second that a server's characters may take at their level.
  [[nodiscard]] double capacity() const { return cores * budget_share; }
};

// Empty when the settings agree with each other; else one line.
std::string validate(const Settings& settings);

}  // namespace hairnet::fleet_plan
