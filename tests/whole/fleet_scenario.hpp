#pragma once

#include <cstdint>

#include "tests/whole/scenario.hpp"

namespace hairnet::whole {

// Runs the trial of one seed. Three of four are of directories alone (directory_scenario.hpp). In the others whole
// servers of a fleet and their clients meet killed, drained and paused servers, broken lines, and an etcd that is down
// or out of a server's reach. No room may have two owners, all clients must have frames again, what moderators have
// decided must move with its room, and nothing may be left when all have gone. Deterministic.
Outcome run_fleet_scenario(std::uint64_t seed, bool is_verbose = false);

}  // namespace hairnet::whole
