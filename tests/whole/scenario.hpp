#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace hairnet::whole {

struct Outcome {
  std::vector<std::string> faults;              // one line each: seed, simulated time, who, what
  std::map<std::string, std::uint64_t> events;  // how often each kind of thing happened
  std::uint64_t hash = 0;                       // of all that clients received
  double simulated_s = 0;
};

// Everything that a seed stands for: a server, rooms, well-behaved clients and others, a network, and what befalls them
// for some seconds; then a calm in which all must be well again; then everybody leaves and nothing may be left.
// Deterministic: the same seed comes to the same outcome. `says_all`: tells on standard error what it does.
Outcome run_scenario(std::uint64_t seed, bool says_all = false);

}  // namespace hairnet::whole
