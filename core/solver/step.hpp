#pragma once

#include <array>
#include <limits>
#include <span>
#include <vector>

#include "core/gravity.hpp"
#include "core/groom/material_scale.hpp"
#include "core/levels/level.hpp"
#include "core/pose/pose.hpp"
#include "core/solver/lane_memory.hpp"
#include "core/solver/level_view.hpp"
#include "core/solver/step_touch.hpp"
#include "core/solver/wind.hpp"

namespace hairnet {

// The lattice state of one character between two steps. Active order, head axes.
struct LatticeState {
  // The displacement of each node from its design, R^-1 (p - t) - p^0, m.
  std::vector<Vec3f> displacement;
  // The velocity of each node in the world, R^-1 p', m/s. Only its axes are the head's.
  std::vector<Vec3f> velocity;
  // The most elastic energy that the last step may have left, J (limit_elastic_energy in step_inl.hpp). Infinite when
  // there was no step yet on this level with this material.
  float elastic_energy_max_j = std::numeric_limits<float>::infinity();
  // The speed of the fastest node relative to the head, at the end of the last step.
  float speed_max_m_per_s = 0;
};

// What acts on all hair of a room alike.
struct Environment {
  Vec3 gravity{0, -kGravity_m_per_s2, 0};  // m/s^2, world
  // The motion of the air. Drag acts on the hair's velocity relative to it.
  WindField wind;
};
// The earth's gravity in still air.
extern const Environment kCalmEnvironment;

// One step of one character: the motion of its bones, its own material, and what acts on it. The caller owns all that
// it points to.
struct StepInput {
  // The poses at the start and the end of the step.
  Pose from, to;
  double step_s = 1.0 / 30;
  // Gravity and wind. The environment must outlive the step.
  const Environment* environment = &kCalmEnvironment;
  // The fraction of contact that is switched off, 0 to 1.
  double contact_release = 0;
  // The character's own material, on top of the level's.
  MaterialScale material;
  // The time at the end of the step, at which the wind is sampled.
  double time_s = 0;
  // The hands and props that are near; null for none. They must outlive the step.
  const StepTouch* touch = nullptr;
};

struct SolverSettings {
  // Iterations of conjugate gradient.
  int iterations = 16;
};

// The longest step, and the iterations in a step of this length for each LevelIndex. With them the error of a
// trajectory is about a quarter of the motion on the high level and a tenth on the low (tests/fidelity/README.md). An
// ether level needs one iteration: its system is block diagonal, and the preconditioner solves it. The learnt and the
// rigid level have no steps.
inline constexpr double kStepMax_s = 1.0 / 50;
inline constexpr std::array<int, kLevelCount> kLevelIterations{16, 10, 8, 1, 0, 0};

// The iterations for a step of that length. Shorter steps need fewer for the same error: conjugate gradient converges
// with the square root of the condition number, which grows with the step's length. Asserts that the step has a
// length.
int iterations_for(LevelIndex level, double step_s);

// The smallest number of steps in a tick for which no step exceeds kStepMax_s. Asserts that the tick has a length.
int substep_count_for(double tick_s);

// Buffers of a step, reused for all characters and levels. They grow to the largest level seen and are never freed. One
// thread at a time may use it.
struct StepScratch {
  LaneArena lanes;
  LevelViewScratch view;
};

// One backward Euler step: matrix-free conjugate gradient with block-Jacobi preconditioning, in float and in the
// axes of the head at the end of the step. It starts from the rigid velocity R' P^0. Do not call it for a teleport:
// leave the state as it is, and the lattice moves rigidly with the head. Returns false when the system or its
// solution is not finite; then discard the state (reset_to_rest). Asserts that `state` fits the level, that the step
// has a length and an environment, and that the input's fractions and factors are in range.
//
// The step solves "(M - h df/dp' - h^2 df/dp) dP' = h (f + h df/dp P')" of paper 2.2 in other unknowns:
// y = P'_1 - R'P^0, the velocity at the end of the step relative to the rest's. The displacement at the end is then
// d_1 = R d + h y, where R d is the start's displacement rotated into the new head axes, and
//
//     A y = b = M (R v - R'P^0) + h f|_(y = 0),      A = M - h df/dp' - h^2 df/dp.
//
// The translation of the head cancels, and y = 0 is the rest motion, from which CG starts. The error of CG is then
// orthogonal to y at every iteration (y.(A y - b) = 0). Therefore the linearised step never ends with more energy than
// its initial energy plus the energy from outside, at any number of iterations:
//
//     T_1 + V_1 = T_0 + V_0 + W - |y - y_0|^2_M / 2 - y.(h^2 K / 2 + h Q) y,     y_0 = R v - R'P^0.
//
// The springs' true energy at the end can be larger than V_1, since they turn. limit_elastic_energy (step_inl.hpp)
// keeps the excess below the energy that the step has dissipated.
[[nodiscard]] bool step(const Level& level, const StepInput& input, const SolverSettings& settings,
                        StepScratch& scratch, LatticeState& state);

// Puts the lattice into its design, at rest in the world, and removes the limit of elastic energy.
void reset_to_rest(const Level& level, LatticeState& state);

}  // namespace hairnet
