#pragma once

#include <vector>

#include "client/viewer/characters/load_characters.hpp"
#include "client/viewer/characters/options.hpp"
#include "client/viewer/offline/stream.hpp"
#include "client/viewer/sources/local_world.hpp"

namespace hairnet::viewer {

// Makes a world at its start time with the characters in it. Builds only the level that each of them has, which takes
// seconds, and shows a progress bar. Learnt hair gets level low, since nothing is learnt here. Grooms are shared and
// motions copied, so `characters` may go before the world.
LocalWorld local_world_of(const ViewOptions& options, const std::vector<CharacterSetup>& characters);

// Simulates the characters here as fast as possible, from the beginning to the end that `options` sets. Writes the
// trace. Returns the moments at each of `moment_times_s` (ascending), like a stream. The same options give the same
// bits, on one machine: no clock decides what is computed. A stop signal ends it early.
StreamResult run_locally(const ViewOptions& options, const std::vector<CharacterSetup>& characters,
                         const std::vector<double>& moment_times_s);

}  // namespace hairnet::viewer
