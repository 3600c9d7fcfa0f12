#pragma once

#include "client/tools/sim/options.hpp"
#include "core/result.hpp"

namespace hairnet::sim {

// Loads, builds the requested level, steps the clip, writes the files and prints a summary line on stdout. The error is
// one line with the file; files appear whole or not at all.
Result<void> simulate(const SimulateOptions& options);

}  // namespace hairnet::sim
