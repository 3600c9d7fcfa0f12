#pragma once

#include <vector>

#include "core/solver/reference_step.hpp"

namespace hairnet {

// A point of the hair that touches the skin in a step, as reference_step finds it (contact.hpp). The force on node j of
// the point is w_j (force n - stiffness n n^T x_j), where x_j is the node's motion in the step relative to the rigid
// motion.
struct Contact {
  std::size_t point = 0;
  // The unit vector out of the skin, in world axes.
  Vec3 normal;
  // The force when every node moves rigidly, N.
  double force = 0;
  // The point's stiffness times the sum of the weights, N/m.
  double stiffness = 0;
};
// Asserts that `lattice` fits the level.
std::vector<Contact> find_contacts(const Level& level, const StepInput& input, const WorldLattice& lattice);

}  // namespace hairnet
