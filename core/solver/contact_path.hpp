#pragma once

#include "core/solver/reference_step.hpp"

namespace hairnet {

// The place of a contact point at the start of a step, and where it would end with the head and by its own velocity;
// world, for the reference.
struct ContactPath {
  Vec3 from, with_head, ahead;
  // The sum of the weights of its nodes.
  double weight = 0;
};
ContactPath contact_path(const Level& level, const StepInput& input, const WorldLattice& lattice, std::size_t point);

// The factor on every contact's potential in a step.
double contact_scale(const StepInput& input);

}  // namespace hairnet
