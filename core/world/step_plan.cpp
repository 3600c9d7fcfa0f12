#include "core/world/step_plan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/assert.hpp"
#include "core/solver/step.hpp"

namespace hairnet {
namespace {

// The shares of the steps that single ticks would need, and of the iterations in each step, by the number of ticks.
static_assert(kStrideMax == 4, "one share for each number of ticks");
constexpr std::array<double, kStrideMax> kStepShare{1, 3.0 / 4, 2.0 / 3, 1.0 / 2};
constexpr std::array<double, kStrideMax> kIterationShare{1, 3.0 / 5, 3.0 / 5, 3.0 / 5};

StepPlan plan_over(double tick_s, int ticks, int substep_count, int iterations, bool is_iterated) {
  HAIRNET_ASSERT(ticks >= 1);
  HAIRNET_ASSERT(ticks <= kStrideMax);
  const auto n = static_cast<std::size_t>(ticks - 1);
  // An ether level is solved exactly by one iteration, and rigid and learnt levels have no steps to share out.
  if (!is_iterated) return {ticks * tick_s, substep_count, iterations};
  constexpr double kRounding = 1e-9;
  // The number of steps is rounded down; the remaining steps get the iterations of the lost fraction.
  const double steps = ticks * substep_count * kStepShare[n];
  const double whole_steps = std::max(1.0, std::floor(steps + kRounding));
  HAIRNET_ASSERT(whole_steps <= std::numeric_limits<int>::max());
  const double iterations_each = iterations * kIterationShare[n] * steps / whole_steps;
  return {ticks * tick_s, static_cast<int>(whole_steps), std::max(1, static_cast<int>(std::lround(iterations_each)))};
}

}  // namespace

StepPlans::StepPlans(double tick_s, int substep_count, int iterations) {
  HAIRNET_ASSERT(tick_s > 0);
  HAIRNET_ASSERT(substep_count >= 1);
  HAIRNET_ASSERT(iterations >= 0);
  for (std::size_t l = 0; l < kLevelCount; ++l) {
    const auto level = static_cast<LevelIndex>(l);
    const int own = iterations > 0 ? iterations : iterations_for(level, tick_s / substep_count);
    const bool is_iterated = kLevelIterations[l] > 1;
    for (int ticks = 1; ticks <= kStrideMax; ++ticks) {
      StepPlan& plan = plans_[l][static_cast<std::size_t>(ticks - 1)];
      plan = plan_over(tick_s, ticks, substep_count, own, is_iterated);
      // Stepping several ticks at once must never cost more than stepping each.
      HAIRNET_ASSERT(plan.substep_count <= ticks * substep_count);
    }
  }
}

}  // namespace hairnet
