#pragma once

#include "client/tools/sim/options.hpp"
#include "core/result.hpp"

namespace hairnet::sim {

// Replays a recording and compares World::hash after every tick, which shows whether this build on this machine
// computes the same bits. Returns an error at the first difference, and for a recording that is damaged or ends early
// (after all complete ticks have been replayed and their files written).
Result<void> replay(const ReplayOptions& options);

}  // namespace hairnet::sim
