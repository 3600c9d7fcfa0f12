#pragma once

#include <functional>
#include <vector>

#include "core/solver/step.hpp"
#include "tests/support/corpus.hpp"

// Trajectories of the shipped step with its conjugate gradient cut off, and how far they lie from converged ones.
namespace hairnet::fidelity {

// So many iterations solve a step to convergence. A step that needs fewer takes fewer.
inline constexpr int kConverged = 400;

struct CutOff {
  double rate_hz = 25;
  int substeps = 1, iterations = kConverged;
};

// Node displacements of every tick, the lead-in left out.
struct NodeTrajectory {
  double tick_s = 0;
  std::vector<std::vector<Vec3f>> ticks;
  // The measured mean time of a tick.
  double tick_us = 0;
};

// One way to step a lattice: from rest at the first pose, then by what each step is given.
struct Stepper {
  std::function<void(const StepInput&)> step;
  // Returns the displacements after the last step.
  std::function<std::vector<Vec3f>()> displacement;
};

NodeTrajectory follow(const Stepper& stepper, const Clip& clip, int substeps, float stiffness);
NodeTrajectory integrate(const Level& level, const Motion& motion, const CutOff& setting, float stiffness,
                         double duration_s);

// RMS over ticks and nodes, weighted by mass, of the difference over that of `truth`; sampled at the ticks of `a`. Not
// finite when `a` is not.
double relative_error(const Level& level, const NodeTrajectory& a, const NodeTrajectory& truth);

}  // namespace hairnet::fidelity
