#pragma once

#include "core/groom/material_scale.hpp"
#include "core/solver/head_motion.hpp"
#include "core/solver/step.hpp"

namespace hairnet {

// Kinetic energy relative to the rigid motion with the head, and elastic energy (springs, attachments, ether), J.
// `motion`: the head motion of the step that led to `state`. Asserts that `state` fits the level. Tests use it, and
// level switches for its kinetic part; the step keeps its own sums.
struct LatticeEnergy {
  double kinetic_j = 0, elastic_j = 0;
};
LatticeEnergy energy(const Level& level, const MaterialScale& material, const HeadMotion& motion,
                     const LatticeState& state);

}  // namespace hairnet
