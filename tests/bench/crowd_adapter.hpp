#pragma once

#if __has_include("core/solver/crowd_step.hpp")
#include "core/solver/crowd_step.hpp"
#else

#include <span>

#include "core/solver/step.hpp"

// The crowd kernel's face over the kernel of one character.
namespace hairnet {

struct CrowdMember {
  const StepInput* input;
  LatticeState* state;
  bool is_finite = true;
};

using CrowdScratch = StepScratch;

inline std::size_t crowd_width() {
  return 16;
}

inline void step_crowd(const Level& level, std::span<CrowdMember> members, const SolverSettings& settings,
                       CrowdScratch& scratch) {
  for (CrowdMember& member : members) {
    member.is_finite = step(level, *member.input, settings, scratch, *member.state);
  }
}

}  // namespace hairnet

#endif
