#pragma once

#include <vector>

#include "client/viewer/characters/load_characters.hpp"
#include "client/viewer/characters/options.hpp"
#include "client/viewer/offline/stream.hpp"
#include "client/viewer/sources/local_world.hpp"

namespace hairnet::viewer {

// A world with the cast in it, each at its level, which is built here with a bar to show how far it is; the others are
// not. It is where it starts.
LocalWorld local_world_of(const ViewOptions& options, const std::vector<CharacterSetup>& characters);

// Simulates the characters here as fast as possible, from the beginning to the end that `options` sets. Returns the
// trace and the moments at each of `moment_times_s` (ascending), like a stream. The same options give the same bits.
StreamResult run_locally(const ViewOptions& options, const std::vector<CharacterSetup>& characters,
                         const std::vector<double>& moment_times_s);

}  // namespace hairnet::viewer
