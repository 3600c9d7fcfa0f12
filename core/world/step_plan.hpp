#pragma once

#include <array>
#include <cstddef>

#include "core/build/level.hpp"

namespace hairnet {

inline constexpr int kStrideMax = 4;

// How a lattice is carried over some ticks at once: in as many steps of equal length, each of so many iterations of
// conjugate gradient.
struct StepPlan {
  double interval_s = 0;  // of all the ticks
  int substep_count = 1;
  int iterations = 1;

  [[nodiscard]] double substep_s() const { return interval_s / substep_count; }
};

// The plan of each level over 1, 2, 3 and 4 ticks. Three are met only while a stride changes.
//
// What lies between a trajectory and that of fine steps is the steps' length far more than their iterations, so several
// ticks at once are saved on both: two ticks take 3/4 of the steps with 3/5 of the iterations, four take half of the
// steps (core/README.md has what that errs and costs). An ether level has nothing to iterate on and takes the steps of
// one tick.
class StepPlans {
 public:
  // `substep_count`: of one tick; `iterations`: of one of its steps on every level, 0 for iterations_for.
  StepPlans(double tick_s, int substep_count, int iterations);

  [[nodiscard]] const StepPlan& of(LevelIndex level, int ticks) const {
    return plans_[static_cast<std::size_t>(level)][static_cast<std::size_t>(ticks - 1)];
  }

 private:
  std::array<std::array<StepPlan, kStrideMax>, kLevelCount> plans_{};
};

}  // namespace hairnet
