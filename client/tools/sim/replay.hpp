#pragma once

#include "client/tools/sim/options.hpp"
#include "core/result.hpp"

namespace hairnet::sim {

// Steps a recording again and compares World::hash after every tick. Refuses at the first difference, and at a
// recording that is damaged or ends early (after the ticks before it have been replayed and their files written).
Result<void> replay(const ReplayOptions& options);

}  // namespace hairnet::sim
