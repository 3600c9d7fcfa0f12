#pragma once

#include <cstddef>

#include "core/solver/lane_memory.hpp"
#include "core/solver/level_view.hpp"

// The kernels of a step, each compiled for several instruction sets; the first call picks the best one for the machine.
namespace hairnet {

// In these a Real holds one float a lane.
LaneSizes crowd_sizes();
LaneSizes single_sizes();

// One step of every lane. `memory` holds terms and states, in the layout's own order. A crowd asserts that the view was
// made for a crowd. Neither checks an index: make_view has.
void crowd_kernel(const LevelView& level, const LaneMemory& memory, int iterations);
void single_kernel(const LevelView& level, const LaneMemory& memory, int iterations);

// Characters' own arrays, `float_count` floats each, to and from the lanes of a crowd: lanes[f * lane_count + l] =
// characters[l][f]. A lane without a character gets zeros. Both assert that there is a lane for each character.
void to_lanes(const float* const* characters, std::size_t character_count, std::size_t float_count, float* lanes);
void from_lanes(const float* lanes, std::size_t float_count, float* const* characters, std::size_t character_count);

}  // namespace hairnet
