#pragma once

#include "core/levels/level.hpp"
#include "core/solver/step.hpp"

namespace hairnet {

// The inputs of one character's step for the kernels, besides its state. Only floats, so that many characters' values
// can lie side by side in memory. Axes of the head at the end of the step; matrices by columns. The default is a
// character at rest that does not move.
struct StepTerms {
  // The map x -> turn x + shift.
  struct AffineMap {
    float turn[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    float shift[3] = {};
  };

  float step_s = 1;
  // Turns vectors from the head's axes at the start to those at the end.
  float turn[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  // The rigid velocity of a node, R' p^0 = turn p^0 + shift, m/s.
  AffineMap rigid_velocity{{}, {}};
  // Gravity without the part that the design includes, g - R g_0, m/s^2.
  float gravity_load[3] = {};

  // The character's own material (MaterialScale), and the active fraction of contact.
  float stiffness = 1, damping = 1, density = 1, ether_damping = 1, air_drag = 1, gel_per_s2 = 0;
  float contact = 1;

  // LatticeState::elastic_energy_max_j at the start of the step.
  float elastic_energy_max_j = 0;

  // They map a point of head space at the step's start, and at its end, to its place relative to each bone at rest.
  AffineMap to_bone_before[kBoneCount], to_bone[kBoneCount];

  // The velocities at the corners of the lattice (LatticeWind), m/s.
  float wind[8][3] = {};
};
inline constexpr std::size_t kStepTermCount = sizeof(StepTerms) / sizeof(float);

// Write numbers as the kernels read them.
void put(const Mat3& m, float (&out)[9]);
void put(const Vec3& v, float (&out)[3]);
void put(const RigidTransform& t, StepTerms::AffineMap& out);

// Asserts that the input's fractions, factors and step are in range.
StepTerms step_terms(const Level& level, const StepInput& input, const LatticeState& state);

}  // namespace hairnet
