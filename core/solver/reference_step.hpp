#pragma once

#include <vector>

#include "core/levels/level.hpp"
#include "core/solver/step.hpp"

namespace hairnet {

// The lattice in the paper's terms: P and P' in world axes, one entry for each active node.
struct WorldLattice {
  std::vector<Vec3> P, P_dot;
};

// Both assert that the state or lattice fits the level.
WorldLattice to_world(const Level& level, const RigidTransform& head, const LatticeState& state);
LatticeState to_head(const Level& level, const RigidTransform& head, const WorldLattice& lattice);

// One step in the paper's notation (paper 2.2), in double and world axes: one linearised system, solved to
// `relative_residual`. It is slow: it is written to be read beside the paper, and the tests compare `step` with it.
// Returns the number of iterations. Asserts that `lattice` fits the level.
int reference_step(const Level& level, const StepInput& input, WorldLattice& lattice, double relative_residual = 1e-10);

}  // namespace hairnet
