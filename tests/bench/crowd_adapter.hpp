#pragma once

#if __has_include("core/solver/crowd_step.hpp")
#include "core/solver/crowd_step.hpp"
#else

#include <span>

#include "core/solver/step.hpp"

// The crowd kernel's face over the kernel of one character.
namespace hairnet {

struct CrowdMember {
  std::span<const StepInput> inputs;
  LatticeState* state = nullptr;
  bool is_finite = true;
};

inline std::size_t crowd_width() {
  return 16;
}

inline void step_crowd(const Level& level, std::span<CrowdMember> members, const SolverSettings& settings,
                       StepScratch& scratch) {
  for (CrowdMember& member : members) {
    for (const StepInput& input : member.inputs) {
      member.is_finite = member.is_finite && step(level, input, settings, scratch, *member.state);
    }
  }
}

}  // namespace hairnet

#endif
