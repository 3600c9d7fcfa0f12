#pragma once

#include <memory>

#include "client/tools/sim/options.hpp"
#include "core/solver/step.hpp"
#include "core/world/world.hpp"

namespace hairnet::sim {

struct StepperDef {
  std::shared_ptr<const LevelSet> levels;
  LevelIndex level = LevelIndex::high;
  double tick_s = 1.0 / 30;
  int substep_count = 1;
  int iterations = 0;  // 0: the level's own
  Environment environment;
  Pose start;
};

// One character, stepped tick by tick, by one of two solvers.
class Stepper {
 public:
  virtual ~Stepper() = default;
  virtual StepReport step(const Pose& to, bool teleport) = 0;
  [[nodiscard]] virtual const LatticeState& state() const = 0;
};

std::unique_ptr<Stepper> make_stepper(Solver solver, const StepperDef& def);

}  // namespace hairnet::sim
