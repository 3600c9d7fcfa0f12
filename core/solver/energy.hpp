#pragma once

#include "core/groom/material_scale.hpp"
#include "core/solver/head_motion.hpp"
#include "core/solver/step.hpp"

namespace hairnet {

// The energy of a lattice, J.
struct LatticeEnergy {
  // The energy of the nodes' motion relative to the rigid motion with the head.
  double kinetic_j = 0;
  // The energy in springs, attachments and ether.
  double elastic_j = 0;
};
// `motion` is the head motion of the step that led to `state`. Asserts that `state` fits the level. A change of level
// uses the kinetic part, and tests use both; steps have sums of their own.
LatticeEnergy energy(const Level& level, const MaterialScale& material, const HeadMotion& motion,
                     const LatticeState& state);

}  // namespace hairnet
