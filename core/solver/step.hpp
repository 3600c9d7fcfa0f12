#pragma once

#include <array>
#include <limits>
#include <span>
#include <vector>

#include "core/build/level.hpp"
#include "core/groom/material_scale.hpp"
#include "core/pose/pose.hpp"
#include "core/solver/wind.hpp"

namespace hairnet {

// One character's lattice: what is stored between steps (model section 0). Active order, axes of the head.
struct LatticeState {
  std::vector<Vec3f> displacement;  // R^-1 (p - t) - p^0, m
  std::vector<Vec3f> velocity;      // R^-1 p', world velocity in head axes, m/s
  // The most elastic energy that the last step may have left, J; infinite when no step on this level with this material
  // came before (hold_to_energy_limit in step.cpp).
  float elastic_energy_max_j = std::numeric_limits<float>::infinity();
};

struct Environment {
  Vec3 gravity{0, -9.81, 0};  // m/s^2, world
  WindField wind;             // drag acts on the velocity relative to it
};

struct StepInput {
  Pose from, to;  // at the start and the end of the step
  double step_s = 1.0 / 30;
  Environment environment;
  double contact_release = 0;  // of CalmRelease
  MaterialScale material;      // the character's own, on what the level was built with
  double time_s = 0;           // at the end of the step, for the wind
};

// Hair that was thrown about can be caught where ether alone cannot free it: on the wrong side of balls around neck and
// shoulders, or folded through itself, its springs as long as designed. Upright nothing presses hair into the body, and
// without balls and springs all that is left of the forces leads home. So once the head has been upright, and neck,
// shoulders and trunk about as at rest to it, for a second, contacts fade within half a second; after three seconds,
// when hair that is not caught has come to rest, springs and attachments fade within another. Any motion of the bones,
// or a tilt, restores them at once.
class CalmRelease {
 public:
  // The share of contact to let go, 0 to 1, when `pose` has lasted `elapsed_s` more.
  double update(const Pose& pose, double elapsed_s);
  // What is left of the stiffness of springs and attachments after the last update, never 0.
  [[nodiscard]] double stiffness() const { return stiffness_; }
  [[nodiscard]] double calm_s() const { return calm_s_; }

 private:
  double calm_s_ = 0, stiffness_ = 1;
};

struct SolverSettings {
  int iterations = 16;  // of conjugate gradient
};

// Measured (tests/fidelity/README.md): with steps of at most this length, and so many iterations on each level, a
// trajectory errs by less than a seventh of the motion on the high level, a twentieth on the medium and a fiftieth on
// the low. An ether level's system is block diagonal: its preconditioner solves it.
inline constexpr double kStepMax_s = 1.0 / 50;
inline constexpr std::array<int, kLevelCount> kLevelIterations{16, 10, 8, 1, 0};

// The least number of steps in a tick that keeps them within kStepMax_s.
int substep_count_for(double tick_s);

// Buffers of `step`, reused between characters; they grow to the largest level met and stay.
struct StepScratch {
  std::vector<Vec3f> rest_velocity, carried;  // R' p^0 and R d, an entry a node
  std::vector<Vec3f> solution, residual, preconditioned, direction, product;
  std::vector<Mat3f> diagonal, preconditioner;  // a node's own 3x3 block of the system, and the inverse of its whole
  std::vector<Vec3f> spring_direction;
  std::vector<float> spring_coefficient, attachment_coefficient;
  std::vector<float> spring_elongation;        // |eps| - |eps_0|, m
  std::vector<Vec3f> attachment_displacement;  // eps - eps_0, m
};

// Backward Euler (model section 6) by matrix-free conjugate gradient with block-Jacobi preconditioning, started at the
// rest velocity R' P^0; float, in the axes of the head at the end of the step. `state` must fit the level. A teleport
// is not a step: the state is then left as it is, and the lattice moves rigidly with the head. No number of iterations
// and no stiffness makes the lattice run away (core/README.md says why). Returns false when the system or its solution
// is not finite; the state is then worthless (reset_to_rest).
[[nodiscard]] bool step(const Level& level, const StepInput& input, const SolverSettings& settings,
                        StepScratch& scratch, LatticeState& state);

void reset_to_rest(const Level& level, LatticeState& state);

// Kinetic energy relative to the rest's motion and elastic energy (springs, attachments, ether), J. `motion`: of the
// step that led to `state`.
struct LatticeEnergy {
  double kinetic_j = 0, elastic_j = 0;
};
struct HeadMotion;
LatticeEnergy energy(const Level& level, const MaterialScale& material, const HeadMotion& motion,
                     const LatticeState& state);

}  // namespace hairnet
