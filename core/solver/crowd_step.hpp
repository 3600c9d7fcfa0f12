#pragma once

#include <span>

#include "core/solver/step.hpp"

namespace hairnet {

// One of the characters that are stepped side by side.
struct CrowdMember {
  std::span<const StepInput> inputs;  // of consecutive steps, as many as every member's
  LatticeState* state = nullptr;      // fits the level
  bool is_finite = true;              // after step_crowd; a state that is not is worthless (reset_to_rest)
};

// How many characters go side by side on this machine: 16 with AVX-512, 8 with AVX2, 4 or 1 elsewhere.
std::size_t crowd_width();

// From how many on a crowd is quicker than one after the other; measured with hairnet-bench.
std::size_t crowd_least();

// `step` for up to crowd_width() characters of one level at once, in the same bits: a lane is a character, and none
// knows of the others. The time is that of a full crowd however few they are.
void step_crowd(const Level& level, std::span<CrowdMember> members, const SolverSettings& settings,
                StepScratch& scratch);

}  // namespace hairnet
