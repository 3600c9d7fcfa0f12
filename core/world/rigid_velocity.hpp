#pragma once

#include "core/assert.hpp"
#include "core/solver/head_motion.hpp"
#include "core/world/character.hpp"

namespace hairnet {

// The head's motion over the last substep, in the axes of the head at its end (c.from). It is no motion after a jump,
// where last_from equals `from`.
inline HeadMotion last_head_motion(const Character& c) {
  StepInput input;
  input.from = c.last_from;
  input.to = c.from;
  input.step_s = c.last_step_s;
  return HeadMotion(input);
}

// Adds `sign` times the rigid velocity to each node's velocity. This is the velocity that the node would have if it
// moved with the head like a part of the skull, in the axes of the head at the end of `motion`. The sign 1 makes
// velocities relative to the head into those in the world, and -1 the reverse. Asserts that the state fits the level.
inline void add_rigid_velocity(const Level& level, const HeadMotion& motion, float sign, LatticeState& state) {
  HAIRNET_ASSERT(state.velocity.size() == level.rest.size());
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    state.velocity[i] += sign * motion.rigid_velocity(level.rest[i].cast<double>()).cast<float>();
  }
}

}  // namespace hairnet
