#pragma once

#include "core/assert.hpp"
#include "core/solver/head_motion.hpp"
#include "core/world/character.hpp"

namespace hairnet {

// The head's motion over the last substep.
inline HeadMotion last_head_motion(const Character& c) {
  StepInput input;
  input.from = c.last_from;
  input.to = c.from;
  input.step_s = c.last_step_s;
  return HeadMotion(input);
}

// Adds `sign` times the rigid velocity, that of hair that moves rigidly with the head; head axes at the end of
// `motion`.
inline void add_rigid_velocity(const Level& level, const HeadMotion& motion, float sign, LatticeState& state) {
  HAIRNET_ASSERT(state.velocity.size() == level.rest.size());
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    state.velocity[i] += sign * motion.rigid_velocity(level.rest[i].cast<double>()).cast<float>();
  }
}

}  // namespace hairnet
