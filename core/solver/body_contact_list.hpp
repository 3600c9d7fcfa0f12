#pragma once

#include <vector>

#include "core/solver/reference_step.hpp"

namespace hairnet {

// A point of the hair that touches a body in a step, as reference_step finds it (body_contact.hpp). The force on node j
// of the point is w_j (force - stiffness x_j), where x_j is the node's motion in the step relative to the rigid motion.
struct BodyContact {
  std::size_t point = 0;
  // The force when every node moves rigidly, N, world.
  Vec3 force;
  // The point's stiffness times the sum of the weights, N/m.
  Mat3 stiffness;
};
// Empty without input.touch. Asserts that `lattice` fits the level.
std::vector<BodyContact> find_body_contacts(const Level& level, const StepInput& input, const WorldLattice& lattice);

}  // namespace hairnet
