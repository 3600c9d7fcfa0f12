#pragma once

#include <vector>

#include "core/levels/level.hpp"
#include "core/solver/step.hpp"

namespace hairnet {

// The lattice as the paper writes it: P and P' in world axes, an entry an active node.
struct WorldLattice {
  std::vector<Vec3> P, P_dot;
};

WorldLattice to_world(const Level& level, const RigidTransform& head, const LatticeState& state);
LatticeState to_head(const Level& level, const RigidTransform& head, const WorldLattice& lattice);

// One step in the paper's notation, in double and world axes: one linearised system, solved to `relative_residual`. It
// is written to be read beside the paper and is the reference for the tests of `step`; it is slow. Returns the number
// of iterations.
int reference_step(const Level& level, const StepInput& input, WorldLattice& lattice, double relative_residual = 1e-10);

}  // namespace hairnet
