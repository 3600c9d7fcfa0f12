#pragma once

#include <vector>

#include "core/solver/reference_step.hpp"

namespace hairnet {

// One point of the hair that meets the skin in a step, as the reference finds it (contact.hpp). Node j of the point,
// with weight w_j, bears w_j (force n - stiffness n n^T x_j), x_j being what it moves in the step beyond its rest.
struct Contact {
  std::size_t point = 0;
  Vec3 normal;           // out of the skin, world
  double force = 0;      // N, when every node moves with its rest
  double stiffness = 0;  // N/m, the weights' sum times that of the point
};
std::vector<Contact> find_contacts(const Level& level, const StepInput& input, const WorldLattice& lattice);

}  // namespace hairnet
