#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace hairnet::whole {

struct Outcome {
  // Each fault is one line with the seed, the simulated time, who has it, and what it is.
  std::vector<std::string> faults;
  // The number of times that each kind of thing happened.
  std::map<std::string, std::uint64_t> events;
  // A hash of everything that clients received. The same seed must give the same hash.
  std::uint64_t hash = 0;
  double simulated_s = 0;
};

// Runs the trial of one seed: a server, rooms, well-behaved and bad clients, and a network with disturbances for some
// seconds. Then the disturbances stop and everything must recover; then all clients leave, and no state may be left.
// Deterministic: the same seed gives the same outcome. `is_verbose`: prints its actions on standard error.
Outcome run_scenario(std::uint64_t seed, bool is_verbose = false);

}  // namespace hairnet::whole
