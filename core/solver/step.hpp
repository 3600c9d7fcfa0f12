#pragma once

#include <span>
#include <vector>

#include "core/build/level.hpp"
#include "core/pose/pose.hpp"

namespace hairnet {

// One character's lattice: what is stored between steps (model section 0). Active order, axes of the head.
struct LatticeState {
  std::vector<Vec3f> displacement;  // R^-1 (p - t) - p^0, m
  std::vector<Vec3f> velocity;      // R^-1 p', world velocity in head axes, m/s
};

// Steady wind; drag acts on the velocity relative to it.
struct Environment {
  Vec3 gravity{0, -9.81, 0};  // m/s^2, world
  Vec3 wind = Vec3::Zero();   // m/s, world
};

struct StepInput {
  Pose from, to;  // at the start and the end of the step
  double step_s = 1.0 / 30;
  Environment environment;
  double contact_release = 0;  // of ContactRelease
};

// Balls around neck and shoulders can catch hair that swung to their wrong side, where the ether alone cannot free it.
// Once head, neck, shoulders and trunk have been about as at rest to each other for a second, contacts that hold hair
// away from its home are let go within another half second; any motion of the bones restores them at once.
class ContactRelease {
 public:
  // The share to let go, 0 to 1, when `pose` has lasted `elapsed_s` more.
  double update(const Pose& pose, double elapsed_s);
  [[nodiscard]] double calm_s() const { return calm_s_; }

 private:
  double calm_s_ = 0;
};

// No hair is this far from its design: a lattice that is has run away.
inline constexpr float kDisplacementMax_m = 10;

struct SolverSettings {
  int iterations = 16;  // of conjugate gradient
};

// Buffers of `step`, reused between characters; they grow to the largest level met and stay.
struct StepScratch {
  std::vector<Vec3f> rest_velocity, carried;  // R' p^0 and R d, an entry a node
  std::vector<Vec3f> solution, residual, preconditioned, direction, product;
  std::vector<Mat3f> diagonal, preconditioner;  // a node's own 3x3 block of the system, and the inverse of its whole
  std::vector<Vec3f> spring_direction;
  std::vector<float> spring_coefficient, attachment_coefficient;
};

// Backward Euler (model section 6) by matrix-free conjugate gradient with block-Jacobi preconditioning, started at the
// rest velocity R' P^0; float, in the axes of the head at the end of the step. `state` must fit the level. A teleport
// is not a step: the state is then left as it is, and the lattice moves rigidly with the head. Returns false when the
// system or its solution is not finite, or a node has run further than kDisplacementMax_m; the state is then worthless
// (reset_to_rest).
[[nodiscard]] bool step(const Level& level, const StepInput& input, const SolverSettings& settings,
                        StepScratch& scratch, LatticeState& state);

void reset_to_rest(const Level& level, LatticeState& state);

// Every number finite, every displacement within kDisplacementMax_m.
bool is_sound(const LatticeState& state);

}  // namespace hairnet
