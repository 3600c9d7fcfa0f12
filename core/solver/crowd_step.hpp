#pragma once

#include <span>

#include "core/solver/step.hpp"

namespace hairnet {

// One of the characters that are stepped side by side. The caller owns both inputs and state.
struct CrowdMember {
  // Consecutive substeps of the character. All members have equally many.
  std::span<const StepInput> inputs;
  // Fits the level.
  LatticeState* state = nullptr;
  // step_crowd sets it; a state that is not finite must be discarded (reset_to_rest).
  bool is_finite = true;
};

// The number of characters side by side on this machine: 16 with AVX-512, 8 with AVX2, 4 or 1 elsewhere.
std::size_t crowd_width();

// The number of characters from which a crowd is faster than single steps; measured with hairnet-bench. A crowd of 16
// takes as long as three characters one by one, a crowd of 8 as long as two.
std::size_t crowd_count_min();

// Steps up to crowd_width() characters of one level at once, one per SIMD lane. Each gets the same bits as from `step`,
// and no lane affects another. The time does not depend on the number of members, but for those that a hand holds:
// these are stepped one by one. Asserts what `step` asserts of each member, that all have the same number of inputs,
// and, with HAIRNET_VALIDATE, that no two share a state.
void step_crowd(const Level& level, std::span<CrowdMember> members, const SolverSettings& settings,
                StepScratch& scratch);

}  // namespace hairnet
