#pragma once

#include <memory>

#include "client/tools/sim/options.hpp"
#include "core/solver/step.hpp"
#include "core/world/world.hpp"

namespace hairnet::sim {

// What a character and its world are made of; the levels must have `level`.
struct StepperDef {
  std::shared_ptr<const LevelSet> levels;
  LevelIndex level = LevelIndex::high;
  double tick_s = 1.0 / 30;
  int substep_count = 1;
  // The iterations of conjugate gradient a substep; zero: the level's own. Only Solver::standard counts them.
  int iterations = 0;
  Environment environment;
  // The pose before the first tick.
  Pose start;
};

// Steps one character tick by tick; each Solver has an implementation. One thread.
class Stepper {
 public:
  virtual ~Stepper() = default;
  // Steps one tick to `to`, the pose at its end. `teleport`: the pose does not continue the one before.
  virtual StepReport step(const Pose& to, bool teleport) = 0;
  // The state after the last step, or at the start; head space.
  [[nodiscard]] virtual const LatticeState& state() const = 0;
};

std::unique_ptr<Stepper> make_stepper(Solver solver, const StepperDef& def);

}  // namespace hairnet::sim
