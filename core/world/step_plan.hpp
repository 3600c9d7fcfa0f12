#pragma once

#include <array>
#include <cstddef>

#include "core/assert.hpp"
#include "core/levels/level.hpp"

namespace hairnet {

// The longest stride, in ticks.
inline constexpr int kStrideMax = 4;

// How a lattice is stepped over one or several ticks at once: the number of equal substeps, and the iterations of
// conjugate gradient in each.
struct StepPlan {
  // The time of all ticks together, s.
  double interval_s = 0;
  int substep_count = 1;
  int iterations = 1;

  [[nodiscard]] double substep_s() const { return interval_s / substep_count; }
};

// The plans of each level for 1, 2, 3 and 4 ticks. Three ticks only occur while a stride changes.
//
// The error of a trajectory depends on the length of the steps far more than on their iterations, so several ticks at
// once save on both: two ticks take 3/4 of the steps with 3/5 of the iterations, four ticks half of the steps
// (core/README.md has errors and costs). An ether level needs no iterations and takes as many steps as one tick.
class StepPlans {
 public:
  // `tick_s` is the length of a tick, and `substep_count` the substeps in one tick. `iterations` is the number in each
  // substep on every level; 0 means iterations_for. Asserts that the tick has a length and at least one substep.
  StepPlans(double tick_s, int substep_count, int iterations);

  // Asserts that `ticks` is from 1 to kStrideMax.
  [[nodiscard]] const StepPlan& of(LevelIndex level, int ticks) const {
    HAIRNET_ASSERT(static_cast<std::size_t>(level) < kLevelCount);
    HAIRNET_ASSERT(ticks >= 1);
    HAIRNET_ASSERT(ticks <= kStrideMax);
    return plans_[static_cast<std::size_t>(level)][static_cast<std::size_t>(ticks - 1)];
  }

 private:
  std::array<std::array<StepPlan, kStrideMax>, kLevelCount> plans_{};
};

}  // namespace hairnet
