#pragma once

#include "core/build/level.hpp"
#include "core/solver/step.hpp"

namespace hairnet {

// Adds every metaball's contact to the system of one step: to `load` (a force, N) and to `diagonal` the block h^2 K of
// its stiffness. Both are about y = 0, where nodes end at rest + carried.
//
// A ball's force is taken where the node would end if it moved rigidly with the ball's own bone, and its stiffness acts
// on the way it moves otherwise. So a body at constant velocity exerts nothing new, and a fast one cannot be jumped
// through.
void add_contacts(const Level& level, const StepInput& input, const LatticeState& state, std::span<const Vec3f> carried,
                  std::span<Vec3f> load, std::span<Mat3f> diagonal);

}  // namespace hairnet
