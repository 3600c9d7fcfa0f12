#pragma once

#include <cstdint>

#include "tests/whole/scenario.hpp"

namespace hairnet::whole {

// Runs the trial of one seed: several servers with directories, one simulated etcd, clients that ask for rooms, and
// faults: lost and late messages, servers cut off from etcd, paused or killed, members of etcd or all of it down,
// clocks of different speed, compactions. No room may have two owners at a time; after the faults each wanted room must
// have one; after the servers have stopped nothing may be left. In every third seed servers claim each other's rooms
// without pause, to have them at the first moment. Every fourth seed lets rooms go on without etcd, and has only faults
// with which these must go on. Deterministic.
Outcome run_directory_scenario(std::uint64_t seed, bool is_verbose = false);

}  // namespace hairnet::whole
